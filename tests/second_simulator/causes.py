"""What can be hidden, each in another functional form than rigid and its generator have it."""

from dataclasses import dataclass
from math import cos, exp, floor, hypot, log, pi, sin, sqrt, tanh

from .plant import AREA, Cause, Push


@dataclass(frozen=True)
class DryFriction(Cause):
    """Sliding friction smoothed by tanh, with a breakaway hump at low speed."""

    force: float
    breakaway: float = 0.3
    slow: float = 2e-4
    nearest = "coulomb-friction"

    def act(self, now, own):
        r = now.speed / self.slow
        return Push(-self.force * tanh(r) * (1.0 + self.breakaway * exp(-r * r)))


@dataclass(frozen=True)
class Dahl(Cause):
    """Dahl's friction: a spring that yields at F_c; the state is the force over F_c."""

    force: float
    stiffness: float
    states = 1
    nearest = "coulomb-friction"

    def act(self, now, own):
        v = now.speed
        return Push(
            -self.force * own[0], rates=(self.stiffness / self.force * (v - own[0] * abs(v)),)
        )


@dataclass(frozen=True)
class OrificeLeak(Cause):
    """Oil past the piston through a gap (laminar) and an orifice (square root)."""

    laminar: float
    orifice: float
    nearest = "piston-leakage"

    def act(self, now, own):
        p = now.p
        return Push(loss=self.laminar * p + self.orifice * p / sqrt(abs(p) + 1e3))


@dataclass(frozen=True)
class ShutValveLeak(Cause):
    """A shut valve that lets oil back: only where nothing is pumped."""

    rate: float
    nearest = "shut-valve-leakage"

    def act(self, now, own):
        return Push(loss=self.rate * now.p if now.inflow == 0.0 else 0.0)


@dataclass(frozen=True)
class DissolvingAir(Cause):
    """Gas of a fraction at rest, isothermal, that goes into solution as pressure rises (Henry)."""

    fraction: float
    solved: float = 40e5
    nearest = "entrained-air"

    def air(self, p):
        absolute = max(p, -0.95e5) + 1.013e5
        return self.fraction * (1.013e5 / absolute * exp(-max(p, 0.0) / self.solved) - 1.0)


@dataclass(frozen=True)
class HoseDrop(Cause):
    """The gauge sits upstream of an orifice: the drop goes with the square of what is much."""

    drop: float
    laminar: float = 1e-5
    nearest = "hose-pressure-drop"

    def read(self, values, now, own):
        values["pressure"] += self.drop * now.inflow * hypot(now.inflow, self.laminar)


@dataclass(frozen=True)
class StageSwitch(Cause):
    """A relief that opens by degrees; wider while pressure falls than while it rises."""

    pressure: float
    left: float = 0.3
    width: float = 8e5
    hysteresis: float = 10e5
    states = 1
    nearest = "pump-stage-switch"

    def act(self, now, own):
        return Push(rates=((now.p - own[0]) / 0.05,))

    @property
    def scales(self):
        return (1e10,)

    def pump(self, litres, now):
        at = self.pressure - self.hysteresis * (now.speed < 0.0)
        x = min(max((now.p - at) / self.width, -300.0), 300.0)
        return litres * (1.0 - (1.0 - self.left) / (1.0 + exp(-x)))


@dataclass(frozen=True)
class Ripple(Cause):
    """A sawtooth of the pump's flow, its corner rounded by four harmonics."""

    share: float
    frequency: float
    nearest = "pump-ripple"

    def pump(self, litres, now):
        angle = 2.0 * pi * (self.frequency * now.t - floor(self.frequency * now.t))
        return litres * (1.0 + self.share * sum(sin(n * angle) / n for n in (1, 2, 3, 4)))


@dataclass(frozen=True)
class ValveRamp(Cause):
    """The valve closes by a share over a ramp, stays, and opens again, in one run.

    - place: which of the runs that are fed then, from 0 for the first to 1
    """

    start: float
    end: float
    share: float
    place: float
    ramp: float = 0.3
    nearest = "valve-event"

    def acts_in(self, run, runs):
        fed = [one for one in runs if one.strap is None and one.valve[0][0] > self.start]
        return run is fed[int(self.place * len(fed))]

    def pump(self, litres, now):
        x = min(now.t - self.start, self.end - now.t) / self.ramp
        return litres * (1.0 - self.share * min(max(x, 0.0), 1.0))


@dataclass(frozen=True)
class Stiffening(Cause):
    """A load-cell end whose stiffness grows with the square root of its compression."""

    growth: float
    nearest = "load-cell-stiffening"

    def load(self, compression, stiffness, own):
        c = max(compression, 0.0)
        return stiffness * compression * (1.0 + self.growth * sqrt(c / 4e-3 + 1e-4))


@dataclass(frozen=True)
class FreeRoot(Cause):
    """A root plate with a mass on a spring and a dashpot; states: place, speed."""

    mass: float
    stiffness: float
    damping: float
    states = 2
    nearest = "free-root-plate"

    def load(self, compression, stiffness, own):
        return stiffness * (compression + own[0])

    def act(self, now, own):
        pull = -now.load - self.stiffness * own[0] - self.damping * own[1]
        return Push(rates=(own[1], pull / self.mass))

    def at_rest(self, load):
        return (-load / self.stiffness, 0.0)

    def set_back(self, load):
        return load / self.stiffness


@dataclass(frozen=True)
class Slack(Cause):
    """A seat whose asperities flatten: the gap closes by a rounded corner."""

    gap: float
    nearest = "seating-slack"

    def contact(self, x):
        h = self.gap
        return 0.5 * (x - h + sqrt((x - h) ** 2 + (0.3 * h) ** 2)) - 0.5 * (
            -h + sqrt(h**2 + (0.3 * h) ** 2)
        )


@dataclass(frozen=True)
class Lag(Cause):
    """A sensor that follows as a second-order low-pass; states: reading, its rate."""

    channel: str
    tau: float
    damping: float = 0.8
    states = 2
    scaled: float = 1.0

    @property
    def nearest(self):
        return {
            "stroke": "stroke-sensor-lag",
            "pressure": "pressure-gauge-lag",
            "acceleration": "accelerometer-resonance",
        }[self.channel]

    @property
    def scales(self):
        unit = {"stroke": 1.0, "pressure": 1e10, "acceleration": 1e8}[self.channel]
        return (unit, unit / self.tau)

    def _fed(self, now):
        return {"stroke": now.stroke, "pressure": now.p, "acceleration": now.a_pl}[self.channel]

    def sensed(self, now, own):
        w = 1.0 / self.tau
        return (own[1], w * w * (self._fed(now) - own[0]) - 2.0 * self.damping * w * own[1])

    def at_rest(self, load):
        return (load / AREA if self.channel == "pressure" else 0.0, 0.0)

    def read(self, values, now, own):
        values[self.channel] = own[0]


@dataclass(frozen=True)
class CreepingCell(Cause):
    """A load cell that creeps by a share of its load with a time constant."""

    share: float
    tau: float
    states = 1
    nearest = "load-cell-creep"

    @property
    def scales(self):
        return (1e9,)

    def act(self, now, own):
        return Push(rates=((now.load - own[0]) / self.tau,))

    def at_rest(self, load):
        return (load,)

    def read(self, values, now, own):
        values["load"] += self.share * own[0]


@dataclass(frozen=True)
class HystereticCell(Cause):
    """A load cell with Bouc and Wen's loop, of exponent 2 and uneven, in its compression.

    The state runs within +-1: width z' = v - 0.7 |v| |z| z - 0.3 v z^2.
    """

    size: float
    width: float
    closing: float = 0.7
    states = 1
    scales = (1e3,)
    nearest = "load-cell-hysteresis"

    def act(self, now, own):
        v, z = -now.v_hc, own[0]
        bent = v - self.closing * abs(v) * abs(z) * z - (1.0 - self.closing) * v * z * z
        return Push(rates=(bent / self.width,))

    def read(self, values, now, own):
        values["load"] += self.size * own[0]


@dataclass(frozen=True)
class Drift(Cause):
    """The load cell's zero wanders: a random walk as a Fourier sum with amplitudes of 1/n."""

    size: float
    span: float
    amplitudes: tuple[float, ...]
    nearest = "load-cell-drift"

    def read(self, values, now, own):
        angle = pi * now.t / self.span
        values["load"] += self.size * sum(
            a / (n + 0.5) * sin((n + 0.5) * angle) for n, a in enumerate(self.amplitudes)
        )


@dataclass(frozen=True)
class Warming(Cause):
    """Gauge and load cell drift with a temperature that settles exponentially."""

    force: float
    pressure: float
    tau: float
    nearest = "temperature-drift"

    def read(self, values, now, own):
        grown = 1.0 - exp(-now.t / self.tau)
        values["load"] += self.force * grown
        values["pressure"] += self.pressure * grown


@dataclass(frozen=True)
class Standing(Cause):
    """A return spring that grows with the stroke's logarithm, as of a gas behind the piston."""

    force: float
    span: float = 0.05
    nearest = "return-spring"

    def act(self, now, own):
        return Push(-self.force * log(1.0 + max(now.stroke, -0.9 * self.span) / self.span))


@dataclass(frozen=True)
class Cubic(Cause):
    """Friction that grows with the square of speed: outside the catalogue."""

    coefficient: float

    def act(self, now, own):
        return Push(-self.coefficient * now.speed * abs(now.speed))


@dataclass(frozen=True)
class StrokeBump(Cause):
    """A tight place in the cylinder, in stroke: outside the catalogue."""

    force: float
    place: float
    width: float

    def act(self, now, own):
        x = (now.stroke - self.place) / self.width
        bump = cos(0.5 * pi * x) ** 2 if abs(x) < 1.0 else 0.0
        return Push(-self.force * bump * tanh(now.speed / 2e-4))
