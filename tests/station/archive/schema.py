"""Validation against the official XML schemas, without a network."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from lxml import etree

FOLDER = Path(__file__).parents[2] / "schemas"
XLINK = "http://www.loc.gov/standards/xlink/xlink.xsd"  # which the others import by its address
NAMESPACES = {
    "mets-1-12-1.xsd": "http://www.loc.gov/METS/",
    "premis-v2-3.xsd": "info:lc/xmlns/premis-v2",
    "mix20.xsd": "http://www.loc.gov/mix/v20",
    "alto-4-4.xsd": "http://www.loc.gov/standards/alto/ns-v4#",
}


class _Local(etree.Resolver):
    def resolve(self, url: str, _public: str, context: Any) -> Any:
        name = "xlink.xsd" if url == XLINK else url
        assert (FOLDER / name).is_file(), f"the schema wants {url}"
        return self.resolve_filename(str(FOLDER / name), context)


@cache
def schema(*names: str) -> Any:
    """Compiled schemas, together: what one of them wraps is validated by the others. Read from FOLDER alone."""
    parser = etree.XMLParser(no_network=True)
    parser.resolvers.add(_Local())
    imports = "".join(f'<xsd:import namespace="{NAMESPACES[name]}" schemaLocation="{name}"/>' for name in names)
    wrapper = f'<xsd:schema xmlns:xsd="http://www.w3.org/2001/XMLSchema">{imports}</xsd:schema>'
    return etree.XMLSchema(etree.fromstring(wrapper, parser))


def violations(compiled: Any, data: bytes) -> list[str]:
    """What a document breaks, with its lines."""
    compiled.validate(etree.fromstring(data).getroottree())
    return [f"{error.line}: {error.message}" for error in compiled.error_log]


def parts(data: bytes, tag: str) -> list[bytes]:
    """Every element of a tag, each as a document of its own."""
    return [etree.tostring(one, with_tail=False) for one in etree.fromstring(data).iter(tag)]
