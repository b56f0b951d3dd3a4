"""Small JSON files, checked against a model."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from restore.errors import BadInput
from restore.formats.parsing.source import DAMAGED, read_bytes

MAX_BYTES = 2**20  # a page of numbers
Model = TypeVar("Model", bound=BaseModel)


def read_model(path: Path, model: type[Model]) -> Model:
    """The contents of a file. Raises BadInput that names the file and the field."""
    try:
        return model.model_validate_json(read_bytes(path, MAX_BYTES))
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(map(str, fault["loc"])) or "its text"
        raise BadInput(f"{path}: {where}: {fault['msg']}", DAMAGED) from error
