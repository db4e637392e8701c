"""Live sources as they are kept and made, and the names of devices."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from app.devices.clock import VirtualClock
from app.devices.webcam import LiveSource, SourceView, SourceViews, WebcamError
from app.devices.webcam.files import VideoFile
from app.devices.webcam.network import MjpegWebcam, RtspWebcam
from app.devices.webcam.opencv import linux_names, shown_names
from app.devices.webcam.sources import make_source


def test_sources_are_written_and_read_again(tmp_path: Path) -> None:
    for source in (
        LiveSource.webcam(3),
        LiveSource.network("10.0.0.7:8080/video"),
        LiveSource.network("rtsp://cam.local/live"),
        LiveSource("video", str(tmp_path / "a.mp4")),
    ):
        assert LiveSource.parse(source.text) == source
        assert source.keepable
        assert source.title
    assert LiveSource.webcam(3).index == 3
    assert LiveSource.webcam(3).title == "Webcam 4"
    assert LiveSource.network("10.0.0.7:8080/x?a=1").title == "10.0.0.7:8080"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "webcam",
        "webcam:",
        "webcam:x",
        "webcam:-1",
        "webcam:64",
        "webcam:" + "9" * 500,
        "webcam:²",
        "disk:/x",
        "video:relative.mp4",
        "stills:/home/anna/photos",  # sources of older versions
        "panorama:/home/anna/room.exr",
        "network:file:///etc/passwd",
        "network:http://a:b@c/",
        "video:/" + "x" * 3000,
    ],
)
def test_damaged_ones_are_refused(text: str) -> None:
    with pytest.raises(WebcamError) as caught:
        LiveSource.parse(text)
    assert caught.value.code == "bad-address"


def test_an_address_with_a_password_is_not_kept() -> None:
    secret = LiveSource.network("http://10.0.0.7/video?user=anna&pwd=geheim")
    assert not secret.keepable
    assert "geheim" not in secret.title
    views = SourceViews().with_(secret, width=640).with_(LiveSource.webcam(0), width=640)
    assert "geheim" not in views.view_of(secret).text
    assert "webcam:0" in views.view_of(secret).text


def test_each_kind_is_made(tmp_path: Path) -> None:
    clock = VirtualClock()
    for source, kind in (
        (LiveSource.network("10.0.0.7"), MjpegWebcam),
        (LiveSource.network("https://10.0.0.7"), MjpegWebcam),
        (LiveSource.network("rtsp://10.0.0.7"), RtspWebcam),
        (LiveSource("video", str(tmp_path / "a.mp4")), VideoFile),
    ):
        assert isinstance(make_source(source, clock, width=640), kind)
    with pytest.raises(WebcamError):
        make_source(LiveSource.webcam(0), clock)


def test_views_are_kept_for_each_source() -> None:
    first, second = LiveSource.webcam(0), LiveSource.network("10.0.0.7")
    views = SourceViews().with_(first, fov_deg=72.0, width=1920).with_(second, learnt_deg=61.25)
    again = SourceViews.parse(views.text)
    assert again.of(first) == SourceView(72.0, None, 1920)
    assert again.of(second) == SourceView(None, 61.2, 0)
    assert again.of(LiveSource.webcam(5)) == SourceView()
    assert again.with_(first, fov_deg=None).of(first) == SourceView(None, None, 1920)


@pytest.mark.parametrize(
    "text",
    [
        "x",
        "[]",
        "{",
        "[" * 10_000,
        '{"webcam:0": 5}',
        '{"webcam:0": {"fov": "x", "learnt": true, "width": 1e9}}',
        '{"webcam:0": {"fov": 1e999, "learnt": NaN, "width": [1]}}',
        '{"webcam:0": {"fov": 5, "learnt": 170}}',
    ],
)
def test_damaged_views_are_as_if_nothing_was_set(text: str) -> None:
    assert SourceViews.parse(text).of(LiveSource.webcam(0)) == SourceView()


def test_the_oldest_views_make_way() -> None:
    views = SourceViews()
    for number in range(30):
        views = views.with_(LiveSource("video", f"/{'x' * 500}/{number}"), width=640)
    kept = SourceViews.parse(views.text)
    assert 3 < len(kept.views) <= 12
    assert kept.of(LiveSource("video", f"/{'x' * 500}/29")).width == 640
    assert len(views.text) <= 4000
    huge = SourceViews().with_(LiveSource("video", "/" + "x" * 5000), width=640)
    assert huge.text == ""


def test_linux_names(tmp_path: Path) -> None:
    for number, index, name in (
        (0, "0", "HD Webcam: HD Webcam\n"),
        (1, "1", "HD Webcam: HD Webcam\n"),
        (2, "0", "HD Webcam: HD Webcam\n"),
        (4, "0", "\n"),
        (10, "0", "Cam Link 4K: Cam Link 4K"),
    ):
        node = tmp_path / f"video{number}"
        node.mkdir()
        (node / "index").write_text(index)
        (node / "name").write_text(name)
    (tmp_path / "videox").mkdir()
    assert linux_names(tmp_path) == (
        (0, "HD Webcam"),
        (2, "HD Webcam (2)"),
        (4, "Webcam 4"),
        (10, "Cam Link 4K"),
    )
    assert linux_names(tmp_path / "missing") == ()


class TestNamesElsewhere:
    MAC = json.dumps(
        {
            "SPCameraDataType": [
                {"_name": "Cam Link 4K", "spcamera_unique-id": "0x14"},
                {"_name": "FaceTime HD", "spcamera_unique-id": "0x10"},
            ]
        }
    )

    def test_mac_in_the_order_of_the_indices(self) -> None:
        asked: list[Sequence[str]] = []

        def ask(command: Sequence[str]) -> str:
            asked.append(command)
            return self.MAC

        assert shown_names((0, 1), "darwin", ask) == ((0, "FaceTime HD"), (1, "Cam Link 4K"))
        assert asked[0][0] == "/usr/sbin/system_profiler"
        assert shown_names((), "darwin", ask) == ()
        assert len(asked) == 1

    def test_a_name_that_may_be_anothers_is_not_used(self) -> None:
        numbered = ((0, "Webcam 1"), (2, "Webcam 3"))
        assert shown_names((0, 2, 3), "darwin", lambda _: self.MAC)[0] == (0, "Webcam 1")
        two = json.dumps([{"FriendlyName": "A"}, {"FriendlyName": "B"}])
        assert shown_names((0, 2), "win32", lambda _: two) == numbered
        for told in ("", "[]", "{}", "[" * 99_999, '{"SPCameraDataType": 5}', "null"):
            assert shown_names((0, 2), "darwin", lambda _, t=told: t) == numbered  # type: ignore[misc]
            assert shown_names((0, 2), "win32", lambda _, t=told: t) == numbered  # type: ignore[misc]
        assert shown_names((0, 2), "freebsd14") == numbered

    def test_windows_with_a_single_one(self) -> None:
        one = json.dumps({"FriendlyName": "HD Pro\u0007 Webcam C920"})
        assert shown_names((0,), "win32", lambda _: one) == ((0, "HD Pro Webcam C920"),)

    def test_a_command_that_is_not_there(self) -> None:
        if not Path("/usr/sbin/system_profiler").exists():
            assert shown_names((0,), "darwin") == ((0, "Webcam 1"),)
