"""A finding, of which a test replaces what it is about."""

from urdyn.diagnose import Finding

FOUND = Finding(
    id="friction_increase-2",
    kind="friction_increase",
    joint=2,
    name="elbow_joint",
    onset_s=0.0,
    onset_interval_s=(0.0, 1.0),
    alarm_s=2.0,
    severity="warning",
    confidence=0.97,
    time_to_failure_s=None,
    size=0.3,
    size_sd=0.01,
    quantity="Coulomb friction",
    unit="-",
    text="elbow_joint: Coulomb friction +30 %",
    advice="check lubrication and the gear of this joint",
)
