"""The page of many bundles: what needs a look first, nothing that a name could smuggle in."""

import base64
import hashlib
import re
from html.parser import HTMLParser

import pytest

from bakery.bake.batch import Outcome
from bakery.formats.mark import MIXED, found
from bakery.show.contact_page import NAME, contact_page, write_contact_page


class Read(HTMLParser):
    """Rows of cells' texts, and the pictures' addresses."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.pictures, self.tags = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        if tag == "tr":
            self.rows.append([dict(attributes).get("class")])
        if tag == "td":
            self.rows[-1].append("")
        if tag == "img":
            self.pictures.append(dict(attributes)["src"])

    def handle_data(self, data):
        if self.rows and len(self.rows[-1]) > 1 and self.tags[-1] != "script":
            self.rows[-1][-1] += data.strip()


@pytest.fixture
def outcomes(tmp_path):
    def one(name, state, *given, **named):
        return Outcome(f"{name}.jpg", str(tmp_path / f"{name}.avatar"), state, *given, **named)

    return [
        one("bob", "baked", 12.34),
        one("a <script>#?%&\"'", "fresh", warnings=["glasses"]),
        one("cy", "failed", error="no <b>face</b>"),
        one("ada", "baked", 9.0),
        one("eve", "baked", 10.0, ["shadow", "yaw"]),
    ]


def test_failed_ones_come_first_then_those_with_warnings(outcomes, tmp_path):
    read = Read(contact_page(tmp_path, outcomes))
    assert [row[:2] for row in read.rows[1:]] == [
        ["failed", "cy"], ["warned", "a <script>#?%&\"'"], ["warned", "eve"], ["baked", "ada"],
        ["baked", "bob"],
    ]  # fmt: skip
    assert [row[3:] for row in read.rows[1:]] == [
        ["", "no <b>face</b>"], ["", "glasses"], ["10.0", "shadow, yaw"], ["9.0", ""], ["12.3", ""],
    ]  # fmt: skip
    assert read.tags.count("script") == 2 and "b" not in read.tags
    assert read.pictures[0] == "a%20%3Cscript%3E%23%3F%25%26%22%27.avatar/preview.png"


def test_the_policy_allows_the_one_script_and_style(outcomes, tmp_path):
    text = contact_page(tmp_path, outcomes)
    for tag in ("script", "style"):
        inside = re.search(f"<{tag}>(.*?)</{tag}>", text, re.DOTALL)[1]
        hashed = base64.b64encode(hashlib.sha256(inside.encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{hashed}'" in text
    assert "default-src 'none'" in text


def test_a_page_of_ours_is_replaced_and_no_other(outcomes, tmp_path, caplog):
    assert write_contact_page(tmp_path, outcomes[:1]) == tmp_path / NAME
    assert write_contact_page(tmp_path, outcomes) == tmp_path / NAME
    assert "5 avatars" in (tmp_path / NAME).read_text(encoding="utf-8")
    assert found(tmp_path / NAME) == MIXED
    (tmp_path / NAME).write_text("<h1>my own page</h1>")
    assert write_contact_page(tmp_path, outcomes) is None
    assert (tmp_path / NAME).read_text() == "<h1>my own page</h1>"
    assert "is not a contact sheet of bakery" in caplog.text
