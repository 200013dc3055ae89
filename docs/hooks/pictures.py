"""The pictures of the pipelines are files of the site: ``pictures/NAME``."""

from pathlib import Path

from mkdocs.structure.files import File

PICTURES = Path(__file__).parents[2] / "pipelines" / "pictures"


def on_files(files, config):
    """Add the pictures."""
    for picture in sorted(PICTURES.iterdir()):
        files.append(File.generated(config, f"pictures/{picture.name}", abs_src_path=str(picture)))
    return files
