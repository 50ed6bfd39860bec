"""Who is painted: every trait of a synthetic person, drawn from a seed or written down."""

from dataclasses import dataclass, field

import numpy as np

from bakery.heads.base import HeadModel

HAIR_STYLES = (
    "crop", "side_part", "swept_back", "receding", "thinning", "curly", "afro", "bald",
    "bob", "fringe", "long", "long_wavy", "curls", "pulled_back", "ponytail", "bun",
)  # fmt: skip
LONG_STYLES = HAIR_STYLES[8:]
CLOTHES = ("crew", "collar", "turtleneck", "suit", "jacket")

# Linear Rec.709 reflectance of hair, from the melanin in it.
HAIR_COLORS = {
    "black": (0.010, 0.0075, 0.0065),
    "dark brown": (0.030, 0.017, 0.0105),
    "brown": (0.072, 0.040, 0.023),
    "chestnut": (0.105, 0.048, 0.024),
    "dark blond": (0.19, 0.12, 0.062),
    "blond": (0.34, 0.235, 0.125),
    "red": (0.19, 0.065, 0.022),
    "grey": (0.27, 0.26, 0.245),
    "white": (0.52, 0.50, 0.47),
}
# Linear reflectance of the iris: its ring around the pupil, and its outer part.
IRIS_COLORS = {
    "dark brown": ((0.050, 0.021, 0.010), (0.030, 0.0125, 0.0065)),
    "brown": ((0.115, 0.052, 0.020), (0.070, 0.032, 0.014)),
    "hazel": ((0.150, 0.080, 0.026), (0.090, 0.085, 0.040)),
    "green": ((0.150, 0.105, 0.040), (0.090, 0.120, 0.070)),
    "grey": ((0.140, 0.120, 0.085), (0.150, 0.175, 0.190)),
    "blue": ((0.135, 0.130, 0.110), (0.105, 0.150, 0.200)),
}


@dataclass(frozen=True)
class Subject:
    """A synthetic person."""

    seed: int  # of everything that is not written down here
    identity: np.ndarray  # [I] standard deviations from the mean head
    age: float = 35.0  # years; wrinkles, skin tone, under-eye
    melanin: float = 0.5  # 0 palest .. 3.5 darkest
    haemoglobin: float = 1.0  # redness, 1 is usual
    freckles: float = 0.0  # 0..1
    moles: int = 3
    stubble: float = 0.0  # 0 none .. 1 three days
    beard: float = 0.0  # mm of full beard, 0 for none
    gloss: float = 1.0  # skin oil
    lip_color: float = 1.0  # 1 bare; more is redder
    iris: str = "brown"  # key of IRIS_COLORS
    hair: str = "crop"  # one of HAIR_STYLES
    hair_color: str = "dark brown"  # key of HAIR_COLORS
    grey: float = 0.0  # share of grey hairs
    hairline: float = 0.0  # mm that the hairline has receded at the temples
    part: float = 1.0  # side of the parting: +1 the subject's left, -1 right
    brow_density: float = 1.0
    brow_length: float = 1.0
    lash_length: float = 1.0
    clothes: str = "crew"  # one of CLOTHES
    cloth_color: np.ndarray = field(default_factory=lambda: np.array([0.05, 0.07, 0.12]))
    shirt_color: tuple[float, float, float] = (0.62, 0.63, 0.65)  # under a suit or a jacket
    tie_color: tuple[float, float, float] | None = None  # None for no tie

    def rng(self, purpose):
        """A generator of this subject's own for one purpose, so that traits do not shift each other."""
        return np.random.default_rng([self.seed, *purpose.encode()])


def random_subject(rng: np.random.Generator, head: HeadModel, spread: float = 0.7) -> Subject:
    """Draw a person.

    Args:
        rng: numpy Generator.
        head: head model.
        spread: standard deviation of the identity coefficients; 1 is the model's own prior.
    """
    count = min(len(head.identity_basis), 60)
    melanin = float(
        rng.choice([rng.uniform(0.1, 0.6), rng.uniform(0.5, 1.4), rng.uniform(1.4, 3.2)])
    )
    age = float(rng.uniform(18, 78))
    woman = bool(rng.random() < 0.5)
    dark = ["black", "black", "dark brown"]
    light = ["dark brown", "brown", "chestnut", "dark blond", "blond", "red"]
    color = str(rng.choice(light if melanin < 0.6 else dark))
    if age > 55 and rng.random() < 0.7:
        color = str(rng.choice(["grey", "white"]))
    styles = (
        ["bob", "pulled_back", "side_part", "long", "long_wavy", "fringe", "bun", "ponytail"]
        if woman
        else ["crop", "side_part", "swept_back"]
    )
    if melanin > 1.4:
        styles += ["curly", "afro", "curly"] + ["curls"] * woman
    if not woman and age > 45:
        styles += ["thinning", "bald", "receding"]
    eyes = list(IRIS_COLORS) if melanin < 0.6 else ["dark brown", "brown"]
    shade = rng.dirichlet([1.5, 1.5, 1.5]) * rng.choice([0.06, 0.3, 1.2])
    return Subject(
        seed=int(rng.integers(2**31)),
        identity=(rng.normal(size=count) * spread).astype(np.float32),
        age=age,
        melanin=melanin,
        haemoglobin=float(rng.uniform(0.7, 1.35)),
        freckles=float(rng.random() < 0.25) * float(rng.uniform(0.2, 1)) * (melanin < 0.7),
        moles=int(rng.integers(0, 9)),
        stubble=0.0 if woman else float(rng.choice([0, rng.uniform(0.2, 1)])),
        beard=0.0 if woman or rng.random() < 0.75 else float(rng.uniform(4, 12)),
        gloss=float(rng.uniform(0.6, 1.4)),
        lip_color=float(rng.uniform(0.8, 1.8)) if woman else float(rng.uniform(0.7, 1.1)),
        iris=str(rng.choice(eyes)),
        hair=str(rng.choice(styles)),
        hair_color=color,
        grey=float(rng.uniform(0, 0.5)) * (age > 42),
        hairline=0.0 if woman else float(rng.uniform(0, 12)),
        part=float(rng.choice([-1, 1])),
        brow_density=float(rng.uniform(0.6, 1.3)) * (0.8 if woman else 1.1),
        brow_length=float(rng.uniform(0.8, 1.1)) * (0.9 if woman else 1.1),
        lash_length=1.15 if woman else 0.85,
        clothes=str(rng.choice(CLOTHES)),
        cloth_color=np.clip(shade, 0.008, 0.75),
        tie_color=None if woman else tuple(rng.dirichlet([1, 1, 1]) * 0.3),
    )
