"""What a filter assumes of an IMU goes by the unit's data sheet."""

import math

import pytest

from drake_quad.estimation.filter_state import DEFAULT_SETTINGS
from drake_quad.estimation.imu_units import IMUS, MTI_300, settings_for


def test_the_default_unit_has_the_default_settings() -> None:
    """Runs with an MTi-300 are as they were before there were others."""
    assert settings_for(MTI_300) == DEFAULT_SETTINGS


@pytest.mark.parametrize("name", IMUS)
def test_no_unit_is_trusted_more_than_its_data_sheet_lets_it(name: str) -> None:
    """Noise and biases are assumed to be at least as large as they are, and ranges as they are."""
    imu, settings = IMUS[name], settings_for(IMUS[name])
    assert settings.gyro_density >= imu.gyro_density
    assert settings.accel_density >= imu.accel_density
    assert settings.initial_gyro_bias >= imu.gyro_turn_on
    assert settings.initial_accel_bias >= imu.accel_turn_on
    # A bias that wanders by so much in its correlation time, as a random walk.
    rate = math.sqrt(2.0 / imu.correlation_time)
    assert settings.gyro_walk >= imu.gyro_instability * rate
    assert settings.accel_walk >= imu.accel_instability * rate
    assert settings.gyro_range == pytest.approx(imu.gyro_range, rel=1e-3)
    assert settings.accel_range == pytest.approx(imu.accel_range, rel=2e-3)


def test_a_cheap_unit_is_trusted_less_than_a_tactical_one() -> None:
    """And neither more than the MTi-300: ground and structure give under any robot."""
    cheap, tactical = settings_for(IMUS["bmi_088"]), settings_for(IMUS["adis_16495"])
    for name in ("gyro_density", "accel_density", "gyro_walk", "initial_accel_bias"):
        assert getattr(cheap, name) > getattr(tactical, name)
        assert getattr(tactical, name) == getattr(DEFAULT_SETTINGS, name)
