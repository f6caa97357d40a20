"""What each effect is, for a reader of the page who has not seen the catalogue."""

WORDS = {
    "coulomb-friction": "a friction force on the plunger that does not depend on speed",
    "stribeck-friction": "a friction force that falls as the plunger starts to move",
    "lugre-friction": "a friction force of bristles that bend before they slide",
    "frequency-dependent-friction": "friction with a memory: its coefficient depends on how fast "
    "the motion changes",
    "pressure-dependent-friction": "seal friction that grows with the oil pressure",
    "return-spring": "a spring or a back pressure pushes the plunger back into the cylinder",
    "effective-area": "the pressure acts on another area than the nominal one",
    "piston-leakage": "oil leaks past the piston, in proportion to the pressure",
    "entrained-air": "air in the oil makes it softer at low pressure",
    "hose-pressure-drop": "the gauge sits before the hose and reads the pressure in the cylinder "
    "plus a drop that grows with the flow",
    "pump-stage-switch": "the pump changes to its slow stage earlier than its curve says",
    "pump-ripple": "a periodic part of the pump's flow",
    "valve-event": "for a stretch of one record the valve passes another fraction of the flow",
    "load-cell-stiffening": "the load-cell end grows stiffer with load",
    "free-root-plate": "the plate behind the load-cell end moves instead of standing still",
    "seating-slack": "clearance or a soft seat is taken up before the plate is in full contact",
    "stroke-sensor-lag": "the stroke sensor follows late",
    "load-cell-drift": "the load cell's zero moves with time",
    "clock-offset": "the pressure's time stamps are shifted against the others",
    "constant-force": "a constant force on the plunger",
    "direction-dependent-viscosity": "the viscous coefficient differs by direction",
}
"""In a phrase, by the effect's name."""
