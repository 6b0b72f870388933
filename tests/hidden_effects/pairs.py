"""Pairs of effects that a recording can hide together and still tell apart.

Every pair of two library effects counts, but for those within one of the groups below: their members change the same
thing in nearly the same way, so that one of them, or a third, takes over what both do. Naming both would be luck.
"""

from itertools import combinations

from effects import KNOWN

CONFOUNDED = {
    "the factor between command and force; with one of two known, the other would need a reference gauge or weight": {
        "valve_gain", "pressure_sensor_gain", "force_gain", "force_sensor_gain", "payload_mass", "leakage",
    },
    "pressure lost or gained by a constant, or by a factor over the narrow range of one load": {
        "valve_offset", "pressure_sensor_offset", "threshold_pressure", "leakage", "valve_gain", "pressure_sensor_gain",
    },
    "the static curve of force over contraction": {
        "bladder_stiffness", "end_effects", "force_gain", "contraction_sensor_gain", "contraction_sensor_offset",
        "series_elasticity", "threshold_pressure",
    },
    "how fast pressure follows the command: order, delay and rate give way to each other; a leak is faster": {
        "valve_lag", "valve_resonance", "valve_dead_time", "flow_limit", "leakage",
    },
    "a slow drift of the force": {"creep", "temperature_drift"},
    "the reading of a weight at rest": {"payload_mass", "force_sensor_offset", "force_sensor_gain"},
}  # fmt: skip

PAIRS = [
    f"{one}+{other}"
    for one, other in combinations(KNOWN, 2)
    if not any({one, other} <= group for group in CONFOUNDED.values())
]

# A pair logs what cuts the chain between its two effects: without it they are as good as confounded.
NEEDS_COLUMN_IN_PAIR = {
    **dict.fromkeys(
        ["valve_lag", "valve_resonance", "valve_dead_time", "valve_dead_band", "valve_gain", "valve_offset",
         "supply_saturation", "flow_limit", "leakage"], "gauge_pressure"
    ),
    **dict.fromkeys(
        ["payload_mass", "series_elasticity", "contraction_sensor_offset", "contraction_sensor_gain",
         "contraction_sensor_delay"], "force"
    ),
}  # fmt: skip
