"""Status codes of the time loop and their meaning: the one map from codes to words."""

RUNNING = 0
DERAILED = 1
INWARD_RANGE = 2
WHEEL_LIFT = 3
ROLL_RANGE = 4
YAW_RANGE = 5
NOT_FINITE = 6
END_OF_TRACK = 7
STANDSTILL = 8
BESIDE_RAIL = 10
LAW_NOT_FINITE = 11
WRONG_SIDE = 12
FALLEN = 13

# code -> (root attribute `status`, sentence); {where} is the wheelset or body concerned
STATUS = {
    RUNNING: ("complete", "the run reached its end"),
    DERAILED: ("derailed", "{where} climbed over the rail: a flange's tip stands over its top"),
    WRONG_SIDE: (
        "derailed",
        "{where} went past the guiding face of a rail whose section changes: a flange is on the "
        "wrong side",
    ),
    FALLEN: ("derailed", "{where} found no rail under a wheel, which fell 20 mm"),
    BESIDE_RAIL: (
        "stopped",
        "{where} is beside its rail without having climbed it: the step is too long or the model "
        "is unstable",
    ),
    INWARD_RANGE: ("stopped", "{where} moved a wheel inwards beyond the range of the table"),
    WHEEL_LIFT: ("stopped", "{where} lifted a wheel beyond the range of the model"),
    ROLL_RANGE: ("stopped", "{where} rolled beyond the range of the contact table"),
    YAW_RANGE: ("stopped", "{where} yawed beyond the range of the contact table"),
    NOT_FINITE: (
        "stopped",
        "the state of {where} is not finite: the step is too long or the model is unstable",
    ),
    END_OF_TRACK: ("stopped", "the vehicle reached the end of the track's table"),
    LAW_NOT_FINITE: ("stopped", "{where} gave a value that is not finite"),
    STANDSTILL: ("stopped", "the vehicle came to a standstill: creepage is not defined there"),
}
