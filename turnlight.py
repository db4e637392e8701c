"""Turnlight's Python API and the `turnlight` command.

Measure the light of a place, find how far to turn for each studio style, and render the face:

    import turnlight

    environment = turnlight.read_environment("cafe.exr")
    for result in turnlight.solve(environment):
        print(result.title, result.turn_refined_deg, result.grade)

Angles are in degrees, positive clockwise as seen from above. At turn 0 the sitter faces the middle
column of the panorama. Light and pictures are linear Rec. 709 unless a name says sRGB. Every
error that a caller can act on is a `CoreError`.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from app.core.base.errors import Cancelled as Cancelled
    from app.core.base.errors import CoreError as CoreError
    from app.core.base.progress import Token as Token
    from app.core.base.remarks import Remark as Remark
    from app.core.environment.environment import Environment as Environment
    from app.core.measure.measurement import Measurement as Measurement
    from app.core.measure.options import MeasureOptions as MeasureOptions
    from app.core.places.place import OpenPlace
    from app.core.portrait.render import HeadPicture as HeadPicture
    from app.core.solver.style_result import StyleResult as StyleResult

__all__ = [
    "Cancelled",
    "CoreError",
    "Environment",
    "HeadPicture",
    "MeasureOptions",
    "Measurement",
    "Place",
    "Remark",
    "StyleResult",
    "Token",
    "main",
    "measure",
    "merge",
    "read_environment",
    "render",
    "sentences",
    "solve",
]

Yaw: TypeAlias = float | Literal["auto", "short", "broad"]
Way: TypeAlias = Literal["bracket", "single", "fisheye", "ball", "photos", "film"]

_PACKAGE = "app"
_FOLDER = Path(__file__).resolve().parent / _PACKAGE
_CLASSES = {
    "Cancelled": "app.core.base.errors",
    "CoreError": "app.core.base.errors",
    "Environment": "app.core.environment.environment",
    "HeadPicture": "app.core.portrait.render",
    "MeasureOptions": "app.core.measure.options",
    "Measurement": "app.core.measure.measurement",
    "Remark": "app.core.base.remarks",
    "StyleResult": "app.core.solver.style_result",
    "Token": "app.core.base.progress",
}


def read_environment(path: Path | str, layer: str = "") -> Environment:
    """Read an HDR panorama, repair it and fill its gaps.

    Args:
        path: A 2:1 equirectangular panorama in OpenEXR (``.exr``) or Radiance (``.hdr``) format.
        layer: The layer to read if the file has several. The default is the beauty pass.

    Returns:
        The environment. `radiance` is (H, 2 H, 3) float32, linear Rec. 709, relative, with the
        zenith in row 0 and azimuth 0 in the middle. `warnings` lists repairs and gaps as data, and
        `sentences` puts them into words.

    Raises:
        CoreError: If the file is missing, damaged, not HDR, not 2:1 or black.
    """
    _import_package()
    from app.core.environment import environment

    return environment.read_environment(path, layer)


def sentences(remarks: Iterable[Remark]) -> tuple[str, ...]:
    """Return remarks as sentences.

    Args:
        remarks: The `warnings` of an environment, or the `warnings`, `advice` or `notes` of a
            measurement.

    Returns:
        One or two sentences for each remark, in the same order.
    """
    _import_package()
    from app.words import remarks as words

    return words.sentences(remarks)


def merge(
    files: Sequence[Path | str], *, times: Sequence[float] | None = None, full: bool = False
) -> Measurement:
    """Merge a bracket of exposures into an HDR panorama.

    Args:
        files: JPEG, PNG or TIFF frames in any order, or one folder of them.
        times: Exposure times, in seconds, in the order of the files. They are used instead of those
            in EXIF.
        full: Whether to keep the size of the frames instead of merging at 2048 x 1024 pixels.

    Returns:
        The light, with its lamps, its warnings and the styles that depend on clipped light.
        `environment(name)` converts the light to an environment that can be solved.

    Raises:
        CoreError: If the frames cannot be read or are not a bracket.
    """
    _import_package()
    from app.core.measure.options import MeasureOptions

    seconds = None if times is None else tuple(times)
    return measure(files, options=MeasureOptions(times=seconds, full=full))


def measure(
    files: Sequence[Path | str],
    way: Way = "bracket",
    *,
    options: MeasureOptions | None = None,
    token: Token | None = None,
    report: Callable[[float, object], None] | None = None,
) -> Measurement:
    """Measure the light of a place from photos or a video.

    Args:
        files: JPEG, PNG or TIFF photos, one folder of them, or one video for ``film``.
        way: ``bracket`` for exposures of one panorama, ``single`` for one 360 photo and a rough
            answer, ``fisheye`` for frames with two fisheye circles, ``ball`` for a mirror ball,
            ``photos`` for photos taken all around, or ``film`` for a video of the sitter turning
            once.
        options: Corrections to the lamps, the sun and the masks, and the options of `way`.
        token: Token whose `cancel` method stops the work from another thread.
        report: Function called with the fraction completed, 0 to 1, and the current step.

    Returns:
        The measured light, as returned by `merge`.

    Raises:
        CoreError: If the photos cannot be read or are unusable for this way of measuring.
        Cancelled: If the token is cancelled.
    """
    _import_package()
    from app.core.base.progress import silent
    from app.core.measure import ways

    paths = [Path(file) for file in files]
    return ways.measure(way, paths, options, token, report or silent)


def solve(
    environment: Environment,
    head: str = "generic",
    *,
    styles: Sequence[str] | None = None,
    objective: Literal["picture", "paper"] = "picture",
    yaw: Yaw = 0.0,
    front_deg: float = 0.0,
) -> tuple[StyleResult, ...]:
    """Find the best turn at a place for each built-in style.

    Args:
        environment: The light of the place.
        head: A built-in head (``generic``, ``generic-dark``, ``male`` ...), or the path of a baked
            ``T.npz``.
        styles: Names of the styles to solve, such as ``left-rembrandt``. The default is all styles.
        objective: ``picture`` for the best match to the studio picture, or ``paper`` for the
            highest quality C as defined in the paper.
        yaw: Turn of the face away from the lens, in degrees, positive towards the sitter's own
            left, or ``short``, ``broad`` or ``auto`` to search for the best yaw.
        front_deg: Azimuth of the photographer in the panorama, in degrees, from which turns are
            counted.

    Returns:
        One result for each style, in the order of the head's styles. `turn_refined_deg` is the
        turn, `grade` is ``yes``, ``nearly`` or ``no``, and `match` is 100 for identical pictures.
        Curves are (64,) float64, with one value every 5.625 degrees.

    Raises:
        CoreError: If the head or a style is unknown, or if the environment is unusable.
    """
    _import_package()
    from app.core.environment.environment import reduce
    from app.core.places.solve_place import solve_styles
    from app.core.portrait.head_views import has_views
    from app.core.solver.lens.lens_wish import STRAIGHT, LensWish
    from app.core.solver.lens.view_tables import views_of
    from app.core.solver.search import luminance_of
    from app.core.styles.style_pack_file import load_named_pack
    from app.core.styles.styles import select

    pack = load_named_pack(head)
    names = [style.name for style in select(pack.styles, styles)]
    light = reduce(environment, pack.header.environment)
    wish = LensWish(yaw=yaw) if yaw else STRAIGHT
    views = views_of(pack, head) if wish != STRAIGHT or has_views(head) else ()
    return solve_styles(
        pack,
        views,
        luminance_of(light) if objective == "paper" else light,
        wish,
        objective,
        names=names,
        front_deg=front_deg,
    )


def render(
    environment: Environment,
    turn_deg: float,
    head: str = "generic",
    *,
    yaw_deg: float = 0.0,
    height: int | None = None,
    plain: bool = False,
) -> HeadPicture:
    """Render a head in the light of a place.

    Args:
        environment: The light of the place.
        turn_deg: Azimuth in the panorama that the sitter faces, in degrees.
        head: A built-in head, or the path of a baked ``T.npz``.
        yaw_deg: Turn of the face away from the lens, in degrees, positive towards the sitter's own
            left. The nearest baked view is used.
        height: Height of a portrait with hair and background, 64 to 2048 pixels, or None for the
            transport's small picture on a black background.
        plain: Whether to leave out a portrait's hair, colours and background.

    Returns:
        The picture. `srgb` is (H, W, 3) uint8, exposed for the face. `linear` is (H, W, 3) float32,
        linear Rec. 709, in the same units as the environment.

    Raises:
        CoreError: If the head is unknown or has no portrait, or if the height is out of range.
    """
    _import_package()
    from app.core.portrait.render import render_head

    return render_head(environment, turn_deg, head, yaw_deg=yaw_deg, height=height, plain=plain)


class Place:
    """A saved place, with its light, its notes and the results for each style.

    Turns are counted from the photographer's position, at panorama azimuth `front_deg`.
    """

    def __init__(self, opened: OpenPlace) -> None:
        self._opened = opened

    @classmethod
    def load(cls, folder: Path | str) -> Place:
        """Load a place from its folder.

        Raises:
            CoreError: If the folder contains no place, or if the place has no readable light.
        """
        _import_package()
        from app.core.places.load_saved import load_place

        return cls(load_place(Path(folder)))

    @classmethod
    def create(
        cls, files: Sequence[Path | str], places: Path | str, *, name: str = "", way: str = ""
    ) -> Place:
        """Measure the light from files and save it as a new place.

        Args:
            files: An HDR panorama, the frames of a bracket, photos, a video, or a folder of these.
            places: Folder in which to create the place's own folder.
            name: Name of the place. By default, the name is derived from the files.
            way: How to read photos: ``camera`` for a bracket, ``photos`` for a panorama taken in
                parts, ``ball`` for a mirror ball, or ``film`` for a video.

        Raises:
            CoreError: If the files cannot be read or measured, or if the place cannot be saved.
        """
        _import_package()
        from datetime import datetime

        from app.core.base.progress import Token, silent
        from app.core.places.open_files import OpenOptions, open_paths
        from app.core.storage.settings import Settings

        now = datetime.now().astimezone()
        options = OpenOptions(Path(places), now, Settings(), name=name, way=way)
        opened = open_paths([Path(file) for file in files], options, Token(), silent)
        if opened.trouble is not None:
            raise opened.trouble
        return cls(opened)

    @property
    def folder(self) -> Path:
        """The folder of the place."""
        assert self._opened.folder is not None
        return self._opened.folder

    @property
    def name(self) -> str:
        """The name of the place."""
        return self._opened.place.name

    @property
    def notes(self) -> str:
        """The photographer's notes."""
        return self._opened.place.notes

    @property
    def tags(self) -> tuple[str, ...]:
        """The photographer's tags."""
        return self._opened.place.tags

    @property
    def front_deg(self) -> float:
        """Azimuth of the photographer in the panorama, in degrees."""
        return self._opened.place.front_deg

    @property
    def environment(self) -> Environment:
        """The light of the place."""
        return self._opened.light.environment

    @property
    def results(self) -> tuple[StyleResult, ...]:
        """Results saved with the place, or an empty tuple if it has not been solved yet."""
        return self._opened.place.results

    def solve(self, head: str = "") -> tuple[StyleResult, ...]:
        """Solve the built-in styles with the place's lamps and lens, without saving the results.

        Args:
            head: Name of a head. The default is the head of the place.

        Raises:
            CoreError: If the head is unknown.
        """
        from app.core.places.solve_place import solve_place
        from app.core.portrait.head import load_head
        from app.core.storage.settings import Settings

        place = self._opened.place
        lit = load_head(head or place.head).lit_by(place.studios)
        return solve_place(lit, self._opened.light, (), Settings(), place.front_deg, place.lens)

    def render(
        self, turn_deg: float, head: str = "", *, yaw_deg: float = 0.0, height: int | None = None
    ) -> HeadPicture:
        """Render the place's head at a turn. The arguments are those of `turnlight.render`."""
        return render(
            self.environment,
            turn_deg + self.front_deg,
            head or self._opened.place.head,
            yaw_deg=yaw_deg,
            height=height,
        )


def __getattr__(name: str) -> Any:
    """Import an API class on first use, since `turnlight --help` needs none of them."""
    if name not in _CLASSES:
        raise AttributeError(f"module 'turnlight' has no attribute {name!r}")
    _import_package()
    return getattr(importlib.import_module(_CLASSES[name]), name)


def main() -> int:
    """Run the `turnlight` command.

    Returns:
        The exit code.
    """
    for name in [each for each in sys.modules if each.partition(".")[0] == _PACKAGE]:
        del sys.modules[name]
    try:
        _import_package()
    except ImportError as error:
        sys.stderr.write(f"turnlight: {error}\n")
        return 2
    try:
        from app.cli import main as run
    except KeyboardInterrupt:
        sys.stderr.write("Stopped.\n")
        return 130
    return run()


def _import_package() -> None:
    """Import the package next to this file, even if PYTHONPATH lists another `app` first.

    PYTHONPATH often contains the current folder, sometimes unintentionally because of a trailing
    colon.
    """
    package = sys.modules.get(_PACKAGE)
    if package is not None:
        file = getattr(package, "__file__", None)  # a namespace package has none
        if file and Path(file).resolve().parent == _FOLDER:
            return
        raise ImportError(
            "Another package named “app” is already loaded. Import turnlight in a separate process."
        )
    spec = importlib.util.spec_from_file_location(
        _PACKAGE, _FOLDER / "__init__.py", submodule_search_locations=[str(_FOLDER)]
    )
    if spec is None or spec.loader is None or not (_FOLDER / "cli.py").is_file():
        raise ImportError(
            "Its files are missing, or another package named “app” replaced them. "
            "Reinstall Turnlight in a separate environment."
        )
    package = importlib.util.module_from_spec(spec)
    sys.modules[_PACKAGE] = package
    spec.loader.exec_module(package)


if __name__ == "__main__":
    sys.exit(main())
