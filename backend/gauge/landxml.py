"""LandXML 1.x and Inframodel files, read element by element.

Coordinates in the file are north, east, height; directions clockwise from north. Entities, document
types and network access are refused, so that a file cannot reach or grow beyond itself.
"""

from __future__ import annotations

import io

from lxml import etree

from backend.errors import InputError
from backend.gauge.landxml_document import DocumentReader
from backend.gauge.records import Model


def parse(data: bytes, file: str, epsg: int | None = None) -> Model:
    """The model in a LandXML or Inframodel document. file: what messages call it; epsg: the site's
    CRS, which decides. Raises InputError when it is not such a document; what is not sound in it is
    left out and listed in `skipped`."""
    reader = DocumentReader(file)
    try:
        context = etree.iterparse(
            io.BytesIO(data),
            events=("start", "end"),
            resolve_entities=False,
            no_network=True,
            load_dtd=False,
            dtd_validation=False,
            huge_tree=False,
            remove_comments=True,
            remove_pis=True,
            collect_ids=False,
        )
        for event, element in context:
            reader.on(event, element)
    except etree.XMLSyntaxError as error:
        words = " ".join(str(error).split()) or "it ends too early"
        raise InputError(f"{file}: not well-formed XML: {words}.") from None
    return reader.finish(epsg)
