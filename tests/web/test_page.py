"""A person's path through the page, in a real browser, from disk."""

import json
import shutil
from pathlib import Path

import pytest

from bakery.formats.image import read_photo

AXE = Path(__file__).resolve().parents[2] / "bakery/runtime/viewer/node_modules/axe-core/axe.min.js"


@pytest.fixture(scope="module")
def walked(browser, bakery, bundle, tmp_path_factory):
    """What walk.mjs saw on the page of a bundle with a hostile name; and where its pictures are."""
    folder = tmp_path_factory.mktemp("walk")
    hostile = folder / "<title><img src=x onerror=alert(1)>\u202egpj.avatar"
    shutil.copytree(bundle, hostile)
    page = folder / "page.html"
    done = bakery("preview", hostile, "-o", page)
    assert done.returncode == 0, done.stderr
    (folder / "take.csv").write_text(take())
    report = json.loads(browser("walk.mjs", page, folder / "take.csv", folder, AXE))
    return report, folder


def take():
    """Two seconds of a jaw that opens, as the app writes it."""
    from bakery.formats.livelink import EYES, HEAD, ORDER

    names = [*ORDER, *HEAD, *EYES]
    lines = [",".join(["Timecode", "BlendShapeCount", *names])]
    for frame in range(60):
        values = {"JawOpen": frame / 60, "HeadYaw": 0.2, "MouthSmileLeft": 1.2}
        row = [f"{values.get(name, 0):.4f}" for name in names]
        lines.append(
            f"10:00:{frame // 30:02d}:{frame % 30 * 2:02d}.000,{len(names)},{','.join(row)}"
        )
    return "\n".join(lines) + "\n"


def test_nothing_went_wrong(walked):
    report, _ = walked
    assert report["log"] == [], "console errors, uncaught exceptions or warnings"
    assert report["requests"] == [], "the page must not touch the network"


def test_the_name_is_text(walked):
    report, _ = walked
    assert report["images"] == 0 and report["dialogs"] == 0
    assert report["heading"] == "<title><img src=x onerror=alert(1)>gpj"
    assert "\u202e" not in report["heading"] + report["title"]


def test_controls_do_what_they_say(walked):
    report, _ = walked
    assert report["sliders"] == 52
    assert report["slid"] == {"jawOpen": 0.6, "shown": "0.60"}
    assert report["searched"] == ["mouthSmileLeft", "mouthSmileRight"]
    assert report["both"] == [0.5, 0.5]
    assert report["named"] == 11 and report["keys"] == 6, "ten expressions, neutral, six keys"
    assert report["surprised"] > 0.5, "a named expression was chosen"
    assert report["gaze"][0] > 5, "an eye was dragged to the subject's left"
    assert report["stage"] == ["photo", "studio"]
    assert report["turned"] != 0, "dragging the picture turns the head in the studio"
    assert report["static"] is False, "T holds the static texture"
    assert report["keyboard"][0] < report["keyboard"][1], "arrow keys move a slider"


def test_keys_on_the_picture_in_the_photo(walked):
    """The page's first stage: the photo cannot be turned, so arrow keys move the gaze."""
    keys = walked[0]["keyed"]
    start, gazed, moved, back = (keys[name] for name in ("start", "gazed", "moved", "back"))
    assert keys["role"] == "application" and keys["focused"] == "view"
    assert keys["label"].startswith("Avatar of ")
    assert gazed["gaze"] == pytest.approx([start["gaze"][0] + 4, start["gaze"][1] + 4])
    assert moved["gaze"] == gazed["gaze"] and moved["shift"][0] > 0 == gazed["shift"][0]
    assert back["gaze"] == pytest.approx(start["gaze"]) and back["shift"] == [0, 0]
    assert {one["turned"] for one in (start, gazed, moved, back)} == {0}


@pytest.mark.parametrize("where", ["desktop", "phone"])
def test_axe_objects_to_nothing(walked, where):
    found = walked[0]["axe"][where]
    if found is None:
        pytest.skip("needs axe-core: `npm ci` in bakery/runtime/viewer")
    assert found == []


def test_numbers_that_are_none_are_refused(walked):
    assert walked[0]["wrong"] == [
        "jawOpen: NaN is no weight",
        "no expression 'nothing'",
        "gaze is no number",
        "a head turn is no number",
    ]


def test_a_dropped_take_plays(walked):
    report, _ = walked
    time, opened = report["played"]["playing"]
    assert time > 0
    assert opened == pytest.approx(time / 2, abs=0.001), "the jaw opens by a half a second"
    assert report["played"]["sought"] == pytest.approx(0.75, abs=0.001)
    assert report["played"]["yaw"] == pytest.approx(-11.46, abs=0.01)  # 0.2 radians to the right
    assert "clamped" in report["played"]["notes"]
    assert "row 3" in report["refused"], "a damaged take is refused, with its row"


def test_recording_is_a_webm(walked):
    report, folder = walked
    assert (folder / "recording.webm").read_bytes()[:4] == bytes.fromhex("1a45dfa3")
    assert report["recorded"] > 1000


def test_layers_differ(walked):
    report, _ = walked
    pictures = report["layers"]
    assert len(set(pictures.values())) == len(pictures) == 9, "colour, 3 layers, teeth, 4 lights"
    assert report["unlit"], "and back"
    left, even = report["sides"]  # the subject's left is on the picture's right
    assert left > 1.2 * even, report["sides"]
    assert "nine rows" in report["noLight"]


def test_a_lost_graphics_card_comes_back(walked):
    assert walked[0]["restored"] is True


def test_every_control_has_a_name(walked):
    report, _ = walked
    assert report["nameless"] == []


def test_a_phone_shows_face_and_controls(walked):
    report, _ = walked
    phone = report["phone"]
    assert phone["scroll"] <= phone["width"], "nothing sticks out sideways"
    assert phone["canvas"] > 300 and phone["panel"] > 250
    assert phone["smallest"] >= 38, "buttons are large enough for a finger"
    assert phone["summary"] >= 24, "folds too (WCAG 2.2, 2.5.8)"


@pytest.mark.parametrize("name", ["page", "studio", "phone"])
def test_it_looks_as_before(walked, golden, name):
    """Tolerance: texture filters, and text of another font, differ between machines."""
    _, folder = walked
    golden(f"page-{name}", read_photo(folder / f"{name}.png").encoded, 0.06, 0.03)


def test_cost_of_a_frame(walked):
    """Medians of 15 frames with all 52 weights moving; the machine of the figures is in the log."""
    cost = walked[0]["cost"]
    assert cost["find"] <= 2.0, "milliseconds to find the neighbours"
    assert cost["script"] <= 2.0, "milliseconds of JavaScript for a frame"
    assert cost["stats"]["drawCalls"] <= 6 and cost["stats"]["uniformBytes"] <= 4096
    assert cost["idle"]["drawCalls"] == 3 and cost["idle"]["medians"] == 0
    assert walked[0]["ready"] <= 10_000, "3 s on a quiet machine; tests share theirs"
