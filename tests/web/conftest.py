"""A browser, node, and a made-up avatar that needs no bake. Everything here skips without them."""

import functools
import http.server
import shutil
import subprocess
import threading
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.export.web import WebOptions, web_files
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_linear
from bakery.heads.base import weights
from bakery.heads.lashes import with_lashes
from bakery.runtime.avatar import Avatar
from bakery.stages.atlas import make_atlas
from bakery.stages.mask import activation_masks
from bakery.stages.texture.mouth import mouth_landmarks
from bakery.stages.texture.tongue import seat_tongue
from bakery.types import EXPRESSIONS, Camera, Fit, Textures

ROOT = Path(__file__).resolve().parents[2]
VIEWER = ROOT / "bakery" / "runtime" / "viewer"
ASSETS = ROOT / "bakery" / "assets" / "viewer"
HERE = Path(__file__).parent
SIDE, MOUTHS = 256, 60


@pytest.fixture(scope="session")
def node():
    """A function (script, *arguments) that runs node in the viewer's folder and returns its text."""
    if not (shutil.which("node") and (VIEWER / "node_modules").is_dir()):
        pytest.skip("needs node, and `npm ci` in bakery/runtime/viewer")

    def run(script, *arguments, timeout=300):
        done = subprocess.run(
            ["node", str(script), *map(str, arguments)],
            capture_output=True, text=True, cwd=VIEWER, timeout=timeout,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr[-3000:]
        return done.stdout

    return run


@pytest.fixture(scope="session")
def browser(node):
    """A function (script, *arguments): node, with playwright and a browser as first arguments."""
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
    playwright = VIEWER / "node_modules" / "playwright-core" / "index.mjs"
    if program is None or not playwright.exists():
        pytest.skip("needs chromium, and `npm ci` in bakery/runtime/viewer")

    def run(script, *arguments, timeout=300):
        return node(HERE / script, playwright, program, *arguments, timeout=timeout)

    return run


def smooth(rng, size, blur, channels=3):
    """Random smooth pictures, 0..1."""
    picture = cv2.GaussianBlur(rng.random((*size, channels)).astype(np.float32), (0, 0), blur)
    picture = picture.reshape(*size, channels)
    low, high = picture.min(), picture.max()
    return (picture - low) / (high - low)


@pytest.fixture(scope="session")
def made_up(head):
    """An avatar of random textures: harder to match than a baked one, and no bake moves it."""
    rng = np.random.default_rng(3)
    head, _ = with_lashes(seat_tongue(head, head.mean), head.mean)
    zero = np.zeros(len(EXPRESSIONS), np.float32)
    camera = Camera(
        1500.0, np.array([200.0, 240.0]), np.array([0.05, -0.04, 0.02]),
        np.array([0.0, 10.0, -900.0]), 400, 480,
    )  # fmt: skip
    fit = Fit(
        "makehuman", camera, np.zeros(1), zero, np.zeros(2), np.eye(9, 3), np.zeros(1),
        np.zeros((468, 3)), cameras.project(head.landmarks(head.mean), camera),
    )  # fmt: skip
    poses = np.zeros((MOUTHS, len(EXPRESSIONS)), np.float32)
    lips = [k for k, name in enumerate(EXPRESSIONS) if name.startswith(("jaw", "mouth"))]
    for pose in poses[1:]:
        pose[rng.choice(lips, 3, replace=False)] = rng.uniform(0, 0.8, 3)
    marks = [mouth_landmarks(head, head.mean, head.vertices(head.mean, pose)) for pose in poses]
    keys = [
        weights({"mouthSmileLeft": 1, "mouthSmileRight": 0.8, "cheekSquintLeft": 0.5}),
        weights({"browInnerUp": 1, "jawOpen": 0.9, "eyeWideLeft": 1, "eyeWideRight": 1}),
        weights({"browDownLeft": 1, "browDownRight": 1, "noseSneerLeft": 0.7, "mouthPucker": 0.8}),
    ]
    alpha = smooth(rng, (SIDE, SIDE), 9, 1)
    textures = Textures(
        neutral=(0.1 + 0.6 * smooth(rng, (SIDE, SIDE), 3)).astype(np.float16),
        keys=np.stack([0.05 + 0.8 * smooth(rng, (SIDE, SIDE), 3) for _ in keys]).astype(np.float16),
        key_names=("smile", "surprise", "anger"),
        key_weights=np.stack(keys),
        source=np.where(smooth(rng, (SIDE, SIDE), 12, 1)[..., 0] > 0.4, 1, 3).astype(np.uint8),
        facing=np.ones((SIDE, SIDE), np.float16),
        hair=np.dstack([0.3 * alpha[..., :1] ** 3] * 3 + [alpha[..., :1] ** 3]).astype(np.float16),
        gaze=np.stack([smooth(rng, (30, 60), 2) for _ in range(20)]).astype(np.float16),
        gaze_directions=np.array([[x, y] for x in (-30, -15, 0, 15, 30) for y in (-20, -5, 5, 20)]),
        mouths=np.stack([smooth(rng, (30, 51), 1.5) for _ in poses]).astype(np.float16),
        mouth_landmarks=np.stack(marks),
        mouth_weights=poses,
    )  # fmt: skip
    masks = activation_masks(head, make_atlas(head, 128))
    photo = smooth(rng, (480, 400), 20)
    return Avatar(head, head.mean, fit, textures, masks, photo)


class Site:
    """A folder with web/ of an avatar, on a server that only this machine reaches."""

    def __init__(self, folder, avatar, options):
        self.folder = folder
        files, _ = web_files(avatar, options)
        for name, data in files.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(data)
        shutil.copy(ASSETS / "avatar.js", folder)
        shutil.copy(HERE / "host.html", folder / "index.html")

    def as_seen(self, avatar):
        """The avatar with the pictures as the browser gets them: 8 bits, packed and unpacked."""
        from bakery.export.web import files as web
        from bakery.formats import record

        about = record.parse("web", (self.folder / web.DESCRIPTION).read_bytes())
        atlases = about["atlases"]

        def picture(name):
            found = cv2.imread(str(self.folder / "web" / atlases[name]["file"]), -1)
            swap = {3: cv2.COLOR_BGR2RGB, 4: cv2.COLOR_BGRA2RGBA}
            return cv2.cvtColor(found, swap[found.shape[2]]) if found.ndim == 3 else found

        def cells(name):
            grid, columns, rows = picture(name), atlases[name]["columns"], atlases[name]["rows"]
            height, width = grid.shape[0] // rows, grid.shape[1] // columns
            corners = [divmod(k, columns) for k in range(len(atlases[name]["names"]))]
            return np.stack([grid[r * height :, c * width :][:height, :width] for r, c in corners])

        def layer(name):  # colour multiplied by alpha
            found = picture(name).astype(np.float32) / 255
            return np.dstack([to_linear(found[..., :3]) * found[..., 3:], found[..., 3:]])

        mesh = avatar.textures.hair_mesh
        textures = replace(
            avatar.textures,
            neutral=to_linear(picture("neutral") / 255),
            keys=np.stack([to_linear(picture(key["name"]) / 255) for key in about["keys"]]),
            gaze=to_linear(cells("gaze") / 255),
            mouths=to_linear(cells("mouths") / 255),
            hair=layer("hair"),
            hair_mesh=replace(mesh, texture=layer("hair_cards")) if mesh else None,
        )
        return replace(avatar, textures=textures, masks=cells("masks").astype(np.float32) / 255)


@pytest.fixture(scope="session")
def serve():
    """A function (folder) that serves it and returns the address."""
    servers = []

    def start(folder):
        handler = functools.partial(Quiet, directory=str(folder))
        servers.append(http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler))
        threading.Thread(target=servers[-1].serve_forever, daemon=True).start()
        return f"http://127.0.0.1:{servers[-1].server_address[1]}/"

    yield start
    for server in servers:
        server.shutdown()


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Without a line on stderr for each file."""

    def log_message(self, *_):
        pass


@pytest.fixture(scope="session")
def make_site():
    """A function (folder, avatar, options) that makes a Site."""
    return Site


@pytest.fixture(scope="session")
def site(made_up, tmp_path_factory):
    return Site(tmp_path_factory.mktemp("site"), made_up, WebOptions(quality=95))
