"""What tells that an arm works in contact, as a campaign or an option names it."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from urdyn.cli.app import app
from urdyn.cli.asked import read_as
from urdyn.cli.campaign import Campaign, read_campaign
from urdyn.cli.recording import Recording
from urdyn.errors import CampaignError
from urdyn.io import write
from urdyn.signal import Touch
from urdyn.signal.channels import ever_in_contact
from urdyn.types import Log

CAMPAIGN = """robot = "ur5e"
contact = "bits:1"
[[log]]
path = "run.csv"
[[log]]
path = "run.csv"
contact = "touches"
"""


def test_a_log_is_read_with_the_contact_that_is_named_for_it(tmp_path: Path) -> None:
    rows = np.arange(4.0)
    write(Log(0.1 * rows, {"bits": rows, "touches": rows // 3}), tmp_path / "run.csv")
    (tmp_path / "campaign.toml").write_text(CAMPAIGN)
    logs = read_campaign(tmp_path / "campaign.toml").logs
    assert [one.contact for one in logs] == [Touch("bits", 1), Touch("touches")]
    told = [ever_in_contact(one.read()).tolist() for one in logs]
    assert told == [[False, False, True, True], [False, False, False, True]]
    assert [one.contact for one in read_as(logs, None, None, None, "bits:0")] == 2 * [
        Touch("bits", 0)
    ]
    (tmp_path / "campaign.toml").write_text(CAMPAIGN.replace("touches", ""))
    with pytest.raises(CampaignError, match="contact '': write CHANNEL"):
        read_campaign(tmp_path / "campaign.toml")


def test_the_option_reaches_every_recording_of_a_campaign(tmp_path, monkeypatch) -> None:
    kinds = [f'[[{kind}]]\npath = "run.csv"\n' for kind in ("payload", "validate")]
    (tmp_path / "campaign.toml").write_text(CAMPAIGN + "".join(kinds))
    write(Log(np.arange(4.0), {"bits": np.arange(4.0)}), tmp_path / "run.csv")
    asked: list[Campaign] = []
    monkeypatch.setattr("urdyn.cli.identify._run", lambda campaign, _: asked.append(campaign))
    line = ["identify", str(tmp_path / "campaign.toml"), "--contact", "bits:0"]
    assert CliRunner().invoke(app, line).exit_code == 0
    (given,) = asked
    every = (*given.logs, *given.payloads, *given.validate)
    assert [one.contact for one in every] == 4 * [Touch("bits", 0)]


def test_a_recording_that_is_never_in_contact_by_what_was_named_says_so(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    write(Log(0.1 * np.arange(4.0), {"bits": np.full(4, 8.0), "payload": np.zeros(4)}), path)
    named = [Recording(path, contact=touch) for touch in (None, Touch("bits", 3), Touch("bits", 5))]
    said = [one.complaints(one.read()) for one in named]
    never = f"{path}: never in contact by bits:5: is it the right channel and bit?"
    assert said == [[], [], [never]]
