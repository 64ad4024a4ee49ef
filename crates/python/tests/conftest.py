"""Places of the repository, and a case that runs in a moment."""

from pathlib import Path

import pytest

import anisobond as ab

REPOSITORY = Path(__file__).parents[3]

#: The shipped wave in a shorter, thinner bar: a second or so.
SHORT_WAVE = {
    "body.box.max": "80, 2, 2 mm",
    "grid.spacing": "1 mm",
    "grid.horizon": 2,
    "motion.duration": "8 us",
    "probe.0.at": "20, 1, 1 mm",
    "probe.1.at": "40, 1, 1 mm",
    "output.frames": 2,
}


@pytest.fixture
def repository():
    """The folder of the checkout."""
    return REPOSITORY


@pytest.fixture
def wave():
    """A case that runs in a moment."""
    return ab.Case(REPOSITORY / "cases/wave.toml", set=SHORT_WAVE)


@pytest.fixture(scope="session")
def rock():
    """The rock of the cross-anisotropy document."""
    return ab.Stiffness(REPOSITORY / "cases/materials/rock.toml")


@pytest.fixture(scope="session")
def packing():
    """A small random packing."""
    return ab.Packing.random(number=250, radius="30 mm", porosity=0.48, seed=2)
