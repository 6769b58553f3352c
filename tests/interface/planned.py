"""Cases of a study, without carrying it out."""

from railsim.studies.plan import Plan
from railsim.studies.spec import StudySpec


def combinations(vehicles, tracks, speeds, grid=None, **more):
    spec = StudySpec(vehicles=vehicles, tracks=tracks, speeds=speeds, grid=grid or {}, **more)
    return Plan(spec).cases()
