"""List the layers in an OpenEXR file and choose the one that contains the light.

Renderers write many pictures into one file, such as the beauty pass, ambient occlusion, albedo and
light groups. The name of a layer is the channel name up to its last dot, or the name of a part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.core.base.errors import EnvironmentFileError
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageInput, ImageSpec

UNNAMED: Final = "RGB"
"""Title of the unnamed layer."""

_BEAUTY: Final = ("combined", "beauty", "rgba", "composite")
_MAX_PARTS: Final = 16
_MOST_NAMES: Final = 12


@dataclass(frozen=True, slots=True)
class Layer:
    """A layer in a file.

    Attributes:
        name: Name in the file, such as "ViewLayer.Combined", or "" if the layer has none.
        part: Index of the part of the file that contains the layer.
        channels: Indices of the red, green and blue channels, or of the grey channel alone.
        alpha: Index of the alpha channel, or None if there is none.
    """

    name: str
    part: int
    channels: tuple[int, ...]
    alpha: int | None = None

    @property
    def title(self) -> str:
        """Name by which the user chooses the layer."""
        return self.name or UNNAMED


class LayerError(EnvironmentFileError):
    """A file has several layers but no default, or lacks the requested layer."""

    def __init__(self, file_name: str, layers: tuple[str, ...], layer_name: str = "") -> None:
        names = ", ".join(layers[:_MOST_NAMES]) + (", …" if len(layers) > _MOST_NAMES else "")
        words = (
            tr("{name} has no layer {layer!r}; it has {layers}.", name=file_name, layer=layer_name,
               layers=names)
            if layer_name
            else tr("{name} has several layers: {layers}.", name=file_name, layers=names)
        )  # fmt: skip
        super().__init__(words, tr("Choose the layer with the light (--layer NAME)."))
        self.layers = layers


def layers_of(source: ImageInput) -> tuple[Layer, ...]:
    """List the colour layers in the order of the file, or a lone grey channel if there are none."""
    layers: list[Layer] = []
    grey: list[Layer] = []
    several = source.seek_subimage(1, 0)
    for part in range(_MAX_PARTS):
        if not source.seek_subimage(part, 0):
            break
        spec = source.spec()
        place = str(spec.get_string_attribute("oiio:subimagename")) if several else ""
        layers += _colours(spec, part, place)
        grey += _grey(spec, part, place)
    return tuple(layers or grey[:1])


def choose_layer(layers: Sequence[Layer], layer_name: str, file_name: str) -> Layer:
    """Return the named layer. If no name is given, return the unnamed layer or the beauty pass.

    Raises:
        LayerError: If there are several layers and no default, or if the name belongs to no layer
            or to more than one.
    """
    titles = tuple(layer.title for layer in layers)
    if layer_name:
        matches = [layer for layer in layers if layer.title.lower() == layer_name.lower()]
        matches = matches or [each for each in layers if _last(each.name) == layer_name.lower()]
        if len(matches) != 1:
            raise LayerError(file_name, titles, layer_name)
        return matches[0]
    if len(layers) == 1:
        return layers[0]
    for last in ("", *_BEAUTY):
        matches = [layer for layer in layers if _last(layer.name) == last]
        if len(matches) == 1:
            return matches[0]
        if matches:
            break
    raise LayerError(file_name, titles)


def _last(name: str) -> str:
    return name.rpartition(".")[2].lower()


def _colours(spec: ImageSpec, part: int, place: str) -> list[Layer]:
    """Return the RGB layers of one part."""
    names = [str(name).lower() for name in spec.channelnames]
    where = {name: index for index, name in reversed(list(enumerate(names)))}
    channel_names = [str(name) for name in spec.channelnames]
    prefixes = dict.fromkeys(name[: name.rfind(".") + 1] for name in names)
    layers = []
    for prefix in prefixes:
        channels = _all_of(where, prefix, ("r", "g", "b"))
        channels = channels or _all_of(where, prefix, ("red", "green", "blue"))
        if channels:
            alpha = where.get(f"{prefix}a", where.get(f"{prefix}alpha"))
            own = channel_names[channels[0]][: len(prefix)].rstrip(".")
            layers.append(Layer(_joined(place, own), part, channels, alpha))
    return layers


def _all_of(where: dict[str, int], prefix: str, names: tuple[str, ...]) -> tuple[int, ...]:
    """Return the indices of the named channels, or an empty tuple if any of them is missing."""
    channels = tuple(where[prefix + name] for name in names if prefix + name in where)
    return channels if len(channels) == len(names) else ()


def _joined(place: str, own: str) -> str:
    """Join the names of the part and the layer, which often repeat each other."""
    if not place or own.lower() == place.lower() or own.lower().startswith(f"{place.lower()}."):
        return own or place
    return f"{place}.{own}" if own else place


def _grey(spec: ImageSpec, part: int, place: str) -> list[Layer]:
    """Return the grey channel of a part as a layer, or an empty list if there is none."""
    names = [str(name).lower() for name in spec.channelnames]
    # Luminance with chroma (Y, RY, BY) is another colour space, not grey.
    if "ry" in names or "by" in names:
        return []
    alpha = next((names.index(name) for name in ("a", "alpha") if name in names), None)
    candidates = [names.index(name) for name in ("y", "l", "i", "grey", "gray") if name in names]
    rest = [index for index, name in enumerate(names) if name not in ("a", "alpha", "z")]
    channels = candidates[:1] or (rest if len(rest) == 1 else [])
    return [Layer(place, part, tuple(channels), alpha)] if channels else []
