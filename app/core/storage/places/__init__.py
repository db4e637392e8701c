"""Places: one folder per place and time, with its light, its results and the user's files."""

from app.core.storage.places.light import StoredLight, fingerprint_of, read_light, store_environment
from app.core.storage.places.originals import ORIGINALS, adopt_files
from app.core.storage.places.place import (
    Asked,
    CaptureFacts,
    FrameFacts,
    Location,
    Place,
    PlaceError,
    clean_name,
)
from app.core.storage.places.results import results_from_json, results_to_json
from app.core.storage.places.store import (
    PLACE,
    THUMBNAIL,
    PlaceSummary,
    TrashedPlace,
    capture_folders,
    create_place,
    delete_place,
    list_places,
    list_trash,
    new_capture_folder,
    read_place,
    rename_place,
    restore_place,
    summarise,
    write_place,
)

__all__ = [
    "ORIGINALS",
    "PLACE",
    "THUMBNAIL",
    "Asked",
    "CaptureFacts",
    "FrameFacts",
    "Location",
    "Place",
    "PlaceError",
    "PlaceSummary",
    "StoredLight",
    "TrashedPlace",
    "adopt_files",
    "capture_folders",
    "clean_name",
    "create_place",
    "delete_place",
    "fingerprint_of",
    "list_places",
    "list_trash",
    "new_capture_folder",
    "read_light",
    "read_place",
    "rename_place",
    "restore_place",
    "results_from_json",
    "results_to_json",
    "store_environment",
    "summarise",
    "write_place",
]
