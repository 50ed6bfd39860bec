"""The player for browsers and bundles of other versions: 1.x plays, others are refused in words."""

import json
import shutil


def test_folders_of_other_versions(site, serve, browser, tmp_path):
    """web/ as 1.0 had it draws the same picture; 2.0 and a head elsewhere are refused."""
    folder = shutil.copytree(site.folder, tmp_path / "site")
    table = json.loads((folder / "web" / "avatar.json").read_text())
    assert table["geometry"] == "player.glb" and table["asset"]["version"] == "1.1"

    def variant(name, **changes):
        shutil.copytree(folder / "web", folder / name)
        (folder / name / "avatar.json").write_text(json.dumps(table | changes))

    asset = table["asset"]
    variant("newer", asset=asset | {"version": "1.9"}, strands={"count": 3}, extras={})
    variant("two", asset=asset | {"version": "2.0"})
    variant("none", asset={})
    variant("elsewhere", geometry="../secret.glb")
    variant("old", asset=asset | {"version": "1.0"})
    old = json.loads((folder / "old" / "avatar.json").read_text())
    (folder / "old" / old.pop("geometry")).rename(folder / "old" / "head.glb")
    (folder / "old" / "avatar.json").write_text(json.dumps(old))

    names = ("web/", "old/", "newer/", "two/", "none/", "elsewhere/")
    now, old, newer, *refused = json.loads(browser("versions.mjs", serve(folder), *names))
    assert now["picture"] == old["picture"] == newer["picture"]
    two, none, elsewhere = (one["message"] for one in refused)
    assert "has version 2.0, this player reads 1.x" in two
    assert "this player reads 1.x" in none
    assert "names a file outside of its folder" in elsewhere
