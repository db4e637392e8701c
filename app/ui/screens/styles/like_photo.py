"""Like this photo, which turns the light on a face in a photo into a style."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.errors import StyleError
from app.core.faces.finder import Face, find_faces
from app.core.faces.lamp_likeness import FILLS
from app.core.faces.light_from_face import FaceLight, read_light
from app.core.localization.photo_location import PHOTO_ENDINGS, Photo, is_panorama, read_photo
from app.core.painting.photo_style import photo_lamps, photo_studio, photo_style
from app.core.painting.user_style import UserStyle
from app.core.painting.user_styles import add
from app.core.portrait.head import Head
from app.core.solver.head_shape import HeadShape, load_shape_of
from app.core.solver.transport import render, to_image
from app.core.storage.item_library import one_line
from app.core.styles.lamps import studio_light
from app.core.text import tr
from app.ui.presenters.services import Services
from app.words.styles import photo_note, photo_title

if TYPE_CHECKING:
    from app.ui.presenters.place_controller import PlaceController

SIDE: Final = 256
"""Width and height of each of the three pictures, in logical pixels."""

LIKE_WORDS: Final = tr("Drop a portrait whose light you like, or a panorama")
"""Hint naming the kinds of files that can be dropped on the screen."""

RATIOS: Final = (
    ("none", tr("No fill")),
    *((f"{ratio:g}", f"{ratio:g}:1") for ratio in FILLS),
)
"""Keys and labels for the fill."""

_JOB: Final = "like-photo"
_DRAW_JOB: Final = "like-photo-head"
_FINE: Final = 2  # pixels of the pictures per logical pixel
_ROOM: Final = 1.7  # size of the area around a face, in multiples of its height
_HIGHEST_DEG: Final = 85.0
_CHOICE_INK, _OTHER = (242, 188, 75), (245, 245, 245)
_NO_FACE: Final = tr("No face in this photo can be read.")
_FRONT_CAMERA: Final = tr(
    "This photo was taken with a front camera. If text in it reads backwards, turn on Mirrored."
)
_LOOKS: Final = tr("Choose a photo of someone looking into the lens.")


@dataclass(frozen=True, slots=True, eq=False)
class LikeState:
    """The contents of the sheet.

    Attributes:
        photo, face, head: The whole photo with frames around its faces, the chosen face, and the
            head lit by the lamps. Each is (n, n, 3) uint8 sRGB or None.
        mirrored: Whether the file is a mirror image. The photo is always shown the right way round.
        hint: Advice on a photo from a front camera.
        light: The light found in the photo, including the user's changes.
        read: The light found in the photo, without the user's changes.
        trouble: The reason why there is no style to save.
    """

    name: str
    photo: Bytes | None = field(default=None, repr=False)
    face: Bytes | None = field(default=None, repr=False)
    head: Bytes | None = field(default=None, repr=False)
    faces: tuple[Face, ...] = ()
    chosen: int = 0
    mirrored: bool = False
    light: FaceLight | None = None
    read: FaceLight | None = None
    shape: HeadShape | None = field(default=None, repr=False)
    note: str = ""
    hint: str = ""
    trouble: str = ""

    # viewpoint of the lamp plots; see `app.ui.plots.lamps.Heads`
    distance_m: float = 1.0
    place_light_deg: float | None = None

    @property
    def azimuth_deg(self) -> float:
        """Azimuth of the key in degrees, positive towards the sitter's left."""
        return 0.0 if self.light is None else self.light.azimuth_deg or 0.0

    @property
    def altitude_deg(self) -> float:
        """Altitude of the key, in degrees."""
        return 0.0 if self.light is None else self.light.elevation_deg or 0.0

    @property
    def best(self) -> tuple[float, float] | None:
        """Azimuth and altitude of the key as read, in degrees, or None if nothing was changed."""
        read = self.read
        if read is None or read is self.light:
            return None
        return read.azimuth_deg or 0.0, read.elevation_deg or 0.0

    @property
    def spoken(self) -> str:
        """Direction of the key in words."""
        return self.note


class _Look(NamedTuple):
    """A photo with frames around its faces, the chosen face, and the light on that face."""

    photo: Bytes
    face: Bytes | None = None
    light: FaceLight | None = None


class LikePhoto:
    """Measures the light in a photo and saves it as a style."""

    def __init__(
        self,
        services: Services,
        place_controller: PlaceController,
        show: Callable[[LikeState], None],
    ) -> None:
        self._services, self._place_controller, self._show = services, place_controller, show
        self._photo: Photo | None = None
        self.state: LikeState | None = None

    def take(self, paths: Sequence[Path]) -> bool:
        """Read a photo that was dropped or chosen. Other files are ignored.

        Returns:
            Whether the files were accepted. A panorama is also accepted, and opens as a place.
        """
        if len(paths) != 1 or paths[0].suffix.lower() not in PHOTO_ENDINGS:
            return False
        (path,) = paths
        self._services.runner.submit(
            _JOB,
            lambda *_: None if is_panorama(path) else _read(path),
            title=tr("Reading the light in {name}", name=path.name),
            done=lambda reading: self._take_reading(path, reading),
            failed=self._services.notify.tell_error,
        )
        return True

    def _take_reading(
        self, path: Path, reading: tuple[Photo, tuple[Face, ...], _Look] | None
    ) -> None:
        if reading is None:
            self._place_controller.open_as_place([path])
            return
        self._photo, faces, look = reading
        hint = _FRONT_CAMERA if self._photo.front_camera else ""
        self._looked(LikeState(path.stem, faces=faces, hint=hint), look)

    def set_mirrored(self, mirrored: bool) -> None:
        """Read the photo either as a mirror image or as it is."""
        state, photo = self.state, self._photo
        if state is None or photo is None or mirrored == state.mirrored:
            return

        def work(*_: object) -> tuple[Photo, tuple[Face, ...], _Look]:
            other = photo.flipped
            faces = find_faces(other.picture)
            return other, faces, _looked_at(other, faces, min(state.chosen, max(len(faces) - 1, 0)))

        def done(reading: tuple[Photo, tuple[Face, ...], _Look]) -> None:
            if self.state is None or self._photo is not photo:
                return
            self._photo, faces, look = reading
            number = min(state.chosen, max(len(faces) - 1, 0))
            new_state = replace(state, faces=faces, chosen=number, mirrored=mirrored, light=None)
            self._looked(new_state, look)

        self._services.runner.submit(_JOB, work, done=done, failed=self._services.notify.tell_error)

    def choose(self, number: int) -> None:
        """Switch to another face in the photo."""
        state, photo = self.state, self._photo
        if state is not None and photo is not None:
            self._services.runner.submit(
                _JOB,
                lambda *_: _looked_at(photo, state.faces, number),
                done=lambda look: self._looked(replace(state, chosen=number, light=None), look),
            )

    def _looked(self, state: LikeState, look: _Look) -> None:
        without = f"{_NO_FACE} {_LOOKS}"
        state = replace(state, photo=look.photo, face=look.face, head=None, trouble=without)
        self._put(state, look.light)

    def choose_at(self, across: float, down: float) -> None:
        """Switch to the face at a position, given as fractions of the square picture."""
        state, photo = self.state, self._photo
        if state is None or photo is None:
            return
        rows, columns = photo.picture.shape[:2]
        longer = max(rows, columns)
        x, y = across * longer - (longer - columns) / 2, down * longer - (longer - rows) / 2
        for number, face in enumerate(state.faces):
            left, top, right, bottom = face.box
            if left <= x <= right and top <= y <= bottom and number != state.chosen:
                self.choose(number)

    def move(self, azimuth_deg: float, elevation_deg: float) -> None:
        """Move the key."""
        high = min(max(elevation_deg, -_HIGHEST_DEG), _HIGHEST_DEG)
        self._change(lambda light: replace(light, azimuth_deg=azimuth_deg, elevation_deg=high))

    def go_back(self) -> None:
        """Restore the light found in the photo."""
        if self.state is not None and self.state.read is not None:
            self._put(self.state, self.state.read)

    def set_size(self, size_deg: float) -> None:
        """Make the key softer or harder by setting its size in degrees."""
        self._change(lambda light: replace(light, softness_deg=size_deg))

    def set_fill(self, key: str) -> None:
        """Set the fill, given as a key from `RATIOS`."""
        ratio = None if key == "none" else float(key)
        self._change(lambda light: replace(light, fill_ratio=ratio))

    def save(self) -> None:
        """Save the light as one of the user's styles, and choose that style."""
        state, head, folder = self.state, self._services.model.head, self._services.folders.styles
        if state is None or state.light is None or state.trouble or head is None:
            return
        light, read = state.light, state.light is state.read

        def on_saved(style: UserStyle) -> None:
            self._place_controller.own_styles.add(style)
            self._place_controller.refresh_user_styles()
            words = tr("{title} saved to your styles.", title=style.title)
            self._services.notify.tell(words, kind="done")

        self._place_controller.file_work.submit(
            lambda *_: add(
                folder,
                photo_style(
                    light,
                    head.pack,
                    head.transport,
                    state.name,
                    photo_title(one_line(state.name)),
                    photo_note(photo_lamps(light), read=read),
                ),
            ),
            done=on_saved,
            failed=self._services.notify.tell_error,
        )

    def _change(self, change: Callable[[FaceLight], FaceLight]) -> None:
        if self.state is not None and self.state.light is not None and not self.state.trouble:
            self._put(self.state, change(self.state.light))

    def _put(self, state: LikeState, light: FaceLight | None = None) -> None:
        """Show a light, and start rendering the head as lit by that light."""
        head = self._services.model.head
        trouble, note, read = state.trouble, "", state.read
        if light is not None:
            read = light if state.light is None else read
            try:
                note, trouble = _note(light, light is read), ""
            except StyleError as error:
                trouble = str(error)
        head = None if trouble else head
        shape = None if head is None else load_shape_of(head.transport, head.name)
        self.state = replace(state, light=light, note=note, trouble=trouble, read=read, shape=shape)
        self._show(self.state)
        if head is not None and light is not None:
            self._services.runner.submit(
                _DRAW_JOB, lambda *_: _draw_head(head, light), done=self._take_drawing
            )

    def _take_drawing(self, picture: Bytes) -> None:
        if self.state is not None:
            self.state = replace(self.state, head=picture)
            self._show(self.state)


def _note(light: FaceLight, read: bool) -> str:
    words = photo_note(photo_lamps(light), read=read)
    if not read or light.error_deg is None:
        return words
    return tr("{words} The direction may be {error:.0f}° off.", words=words, error=light.error_deg)


def _read(path: Path) -> tuple[Photo, tuple[Face, ...], _Look]:
    photo = read_photo(path)
    faces = find_faces(photo.picture)
    return photo, faces, _looked_at(photo, faces, 0)


def _looked_at(photo: Photo, faces: tuple[Face, ...], number: int) -> _Look:
    whole = _framed(photo.picture, faces, number)
    if not faces:
        return _Look(whole)
    face = faces[number]
    light = read_light(photo.picture, face, photo.focal_px)
    return _Look(whole, _cropped(photo.picture, face), light)


def _draw_head(head: Head, light: FaceLight) -> Bytes:
    """Render the head as lit by the lamps in the photo."""
    style, studio = photo_studio(light)
    glow = render(head.transport, studio_light(style, studio, head.transport.environment_shape))
    like_style = replace(style, lamps=photo_lamps(light))
    picture = np.repeat(to_image(head.transport, glow)[..., None], 3, axis=2)
    return head.portrait(picture, (_FINE * SIDE, _FINE * SIDE), like_style)


def _square(picture: Bytes) -> Bytes:
    return np.asarray(cv2.resize(picture, (_FINE * SIDE,) * 2, interpolation=cv2.INTER_AREA))


def _framed(picture: Bytes, faces: Sequence[Face], selected: int) -> Bytes:
    """Return the whole photo in a square, with frames around its faces."""
    rows, columns = picture.shape[:2]
    longer = max(rows, columns)
    above, beside = (longer - rows) // 2, (longer - columns) // 2
    whole = np.full((longer, longer, 3), 43, np.uint8)
    whole[above : above + rows, beside : beside + columns] = picture
    whole, scale = _square(whole), _FINE * SIDE / longer
    for number, face in enumerate(faces):
        corners = np.add(np.reshape(face.box, (2, 2)), (beside, above)) * scale
        start, end = np.rint(corners).astype(int).tolist()
        cv2.rectangle(whole, start, end, (16, 16, 16), 3 * _FINE)
        cv2.rectangle(whole, start, end, _CHOICE_INK if number == selected else _OTHER, _FINE)
    return whole


def _cropped(picture: Bytes, face: Face) -> Bytes:
    """Return a square crop of a face with some space around it."""
    left, top, right, bottom = face.box
    x, y = (left + right) / 2, (top + bottom) / 2 - 0.1 * face.side
    edge = max(round(_ROOM * face.side), 2)
    patch = cv2.getRectSubPix(picture, (edge, edge), (x, y))
    return _square(np.asarray(patch, np.uint8))
