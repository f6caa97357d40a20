"""Numbers that are not drawn: units, and what the rig's maker or the logger's sheet states."""

BAR = 1e5  # Pa
PSI = 6894.757293168  # Pa
LITRE_PER_MINUTE = 1e-3 / 60.0  # m^3/s
GRAVITY = 9.80665  # m/s^2, the g of an accelerometer's range

AREA = 44.2e-4  # m^2, pushing area of the plunger, eq. (1)
P_MAX = 700.0 * BAR  # Pa, eq. (22)

SLOW_RATE = 100  # Hz, the field computer and the CR6
FAST_RATE = 1600  # Hz, the accelerometer
TRUTH_RATE = 1000  # Hz, at which the true ice load is kept

COUNT = 200.0 * GRAVITY / 32768.0  # m/s^2 per count of a 16-bit recorder of +-200 g

# Unit of a channel in the files: (name, SI per unit, decimals printed)
FILE_UNITS = {
    "load": ("kN", 1e3, 3),
    "stroke": ("mm", 1e-3, 2),
    "pressure": ("bar", BAR, 4),
}
