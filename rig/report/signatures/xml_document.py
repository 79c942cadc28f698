"""Reading of a signed digital certificate, and its reconstruction from the signed content alone."""

import re
from base64 import b64decode, b64encode
from hashlib import sha256
from typing import Any

from lxml import etree
from signxml.algorithms import CanonicalizationMethod, DigestAlgorithm, SignatureConstructionMethod
from signxml.util import namespaces

NAMES = {"ds": namespaces.ds, "xades": namespaces.xades}
PROPERTIES_SUFFIX = "-SignedProperties"  # of the Id of the signed properties, after the signature's Id
_ENCODINGS = {  # first bytes → the codec, and its names in the declaration
    b"\xff\xfe": ("utf-16", {"utf-16", "utf-16le"}),
    b"\xfe\xff": ("utf-16", {"utf-16", "utf-16be"}),
    b"<\0": ("utf-16-le", {"utf-16", "utf-16le"}),
    b"\0<": ("utf-16-be", {"utf-16", "utf-16be"}),
}
_UTF_8 = ("utf-8-sig", {"utf-8"})
_DECLARATION = re.compile(
    r"""<\?xml\s+version\s*=\s*(["'])1\.0\1
        (?:\s+encoding\s*=\s*(["'])(?P<encoding>[A-Za-z0-9_-]+)\2)?
        (?:\s+standalone\s*=\s*(["'])(?:yes|no)\4)?\s*\?>""",
    re.VERBOSE,
)


def read_xml(content: bytes) -> Any:
    """Return the root of a document in UTF-8 or UTF-16, with or without a declaration.

    The bytes determine the encoding, so that all readers see the same text. Raise ValueError for another encoding, for
    a declaration that contradicts the bytes, and for a document type; also raise the errors of lxml.
    """
    codec, names = _ENCODINGS.get(content[:2], _UTF_8)
    text = content.decode(codec)
    if text.startswith("\ufeff"):
        raise ValueError("it has two marks of the byte order")
    declaration = _DECLARATION.match(text)
    if declaration is not None:
        encoding = declaration["encoding"]
        if encoding is not None and encoding.lower() not in names:
            raise ValueError(f"it declares the encoding {encoding}, but is {codec}")
        text = text[declaration.end() :]
    elif re.match(r"<\?xml\s", text):
        raise ValueError("its declaration is not one of XML 1.0 in UTF-8 or UTF-16")
    parser = etree.XMLParser(resolve_entities=False, no_network=True, encoding="utf-8")
    root = etree.fromstring(text.encode(), parser)
    if root.getroottree().docinfo.doctype:
        raise ValueError("it has a document type, which no signature covers")
    return root


def canonical(root: Any) -> bytes:
    """Return the document's visible content: its canonical form (C14N) with comments."""
    text: bytes = etree.tostring(root.getroottree(), method="c14n", with_comments=True)
    return text


def rebuild_document(verified: tuple[bytes, bytes, bytes], method: str, value: str) -> Any:
    """Return the root of the only document that this signature validates, built from verified content alone.

    `verified` are the signed canonical forms: of the document without its signature, of the signed properties (XAdES)
    and of the key's certificates. `method` is the signature's method and `value` its value in base64. Names follow from
    the signed properties, everything else from the form of the rig's signatures.
    """
    document, properties, key_info = verified
    root, signed_properties, certificates = map(etree.fromstring, verified)
    name = signed_properties.get("Id", "").partition(PROPERTIES_SUFFIX)[0]
    about = signed_properties.find(".//xades:DataObjectFormat", NAMES).get("ObjectReference", "")
    signature = etree.SubElement(root, _ds("Signature"), nsmap=NAMES, Id=name)
    info = etree.SubElement(signature, _ds("SignedInfo"))
    etree.SubElement(info, _ds("CanonicalizationMethod"), Algorithm=CanonicalizationMethod.CANONICAL_XML_1_1.value)
    etree.SubElement(info, _ds("SignatureMethod"), Algorithm=method)
    of_document = _reference(info, document, URI="", Id=about.removeprefix("#"))
    transforms = etree.Element(_ds("Transforms"))
    of_document.insert(0, transforms)
    for transform in (SignatureConstructionMethod.enveloped, CanonicalizationMethod.CANONICAL_XML_1_1):
        etree.SubElement(transforms, _ds("Transform"), Algorithm=transform.value)
    kind = "http://uri.etsi.org/01903#SignedProperties"
    _reference(info, properties, URI=f"#{signed_properties.get('Id')}", Type=kind)
    _reference(info, key_info, URI=f"#{certificates.get('Id')}")
    etree.SubElement(signature, _ds("SignatureValue")).text = b64encode(b64decode(value)).decode()
    signature.append(certificates)
    holder = etree.SubElement(signature, _ds("Object"))
    qualifying = etree.SubElement(holder, f"{{{namespaces.xades}}}QualifyingProperties", Target=f"#{name}")
    qualifying.append(signed_properties)
    return root


def _reference(info: Any, signed: bytes, **attributes: str) -> Any:
    reference = etree.SubElement(info, _ds("Reference"), **attributes)
    etree.SubElement(reference, _ds("DigestMethod"), Algorithm=DigestAlgorithm.SHA256.value)
    etree.SubElement(reference, _ds("DigestValue")).text = b64encode(sha256(signed).digest()).decode()
    return reference


def _ds(tag: str) -> str:
    return f"{{{namespaces.ds}}}{tag}"
