"""Forgeries of a signed digital certificate: changes of its text, its tree and its signature."""

import copy
import re
from base64 import b64decode, b64encode
from collections.abc import Callable
from typing import Any

from lxml import etree

from support.documents.signing import holder

Forgery = Callable[[bytes], bytes]
DCC, SI = "{https://ptb.de/dcc}", "{https://ptb.de/si}"
DS, XADES = "{http://www.w3.org/2000/09/xmldsig#}", "{http://uri.etsi.org/01903/v1.3.2#}"
VALUE = f".//{SI}valueXMLList"


def written(root: Any) -> bytes:
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8"))


def replace(old: bytes, new: bytes) -> Forgery:
    def forge(content: bytes) -> bytes:
        assert old in content
        return content.replace(old, new, 1)

    return forge


def element(path: str, change: Callable[[Any], object]) -> Forgery:
    """Change the first element of this path."""

    def forge(content: bytes) -> bytes:
        root = etree.fromstring(content)
        node = root.find(path) if path else root
        assert node is not None, path
        change(node)
        return written(root)

    return forge


def signature(change: Callable[[Any], object]) -> Forgery:
    return element(f"{DS}Signature", change)


def change_signed_info(change: Callable[[Any], object]) -> Forgery:
    return element(f".//{DS}SignedInfo", change)


def text(new: str) -> Callable[[Any], None]:
    def change(node: Any) -> None:
        assert node.text != new
        node.text = new

    return change


def attribute(name: str, value: str) -> Callable[[Any], None]:
    return lambda node: node.set(name, value)


def within(tag: str, inside: str | Any | None = None, **attributes: str) -> Callable[[Any], None]:
    """Append an element that holds a text or another element."""

    def change(node: Any) -> None:
        added = etree.SubElement(node, tag, **attributes)
        if isinstance(inside, str):
            added.text = inside
        elif inside is not None:
            added.append(copy.deepcopy(inside))

    return change


def remove(node: Any) -> None:
    node.getparent().remove(node)


def first_last(node: Any) -> None:
    node.append(node[0])


def better_results(root: Any) -> Any:
    """Return the set of results with other numbers."""
    results = copy.deepcopy(root.find(f"{DCC}measurementResults"))
    for value in results.iter(f"{SI}valueXMLList"):
        value.text = "1 1 1"
    return results


def use_another(node: Any) -> None:
    stranger = holder("Laboratory", holder("Authority")).certificates().decode()
    node.text = stranger.split("-----")[2]


def results_beside(node: Any) -> None:
    """Put a second set of results into an Object of the signature, a known attack."""
    within(f"{DS}Object", better_results(node.getroottree().getroot()))(node)


def properties_doubled(node: Any) -> None:
    """Put other properties of the same Id before the signed ones."""
    other = copy.deepcopy(node.find(f".//{XADES}SignedProperties"))
    other.find(f".//{XADES}Description").text = "A calibration certificate"
    holder_ = etree.Element(f"{DS}Object")
    holder_.append(other)
    node.insert(0, holder_)


def properties_elsewhere(node: Any) -> None:
    """Move the signed properties into another Object, and replace them."""
    signed = node.find(f".//{XADES}SignedProperties")
    other = copy.deepcopy(signed)
    other.set("Id", "other")
    other.find(f".//{XADES}Description").text = "A calibration certificate"
    signed.getparent().replace(signed, other)
    etree.SubElement(node, f"{DS}Object").append(signed)


def wrap_content(content: bytes) -> bytes:
    """Move the signed content aside under another name, and replace it (signature wrapping)."""
    root = etree.fromstring(content)
    node = root.find(f"{DS}Signature")
    node.getparent().remove(node)
    aside = etree.fromstring(etree.tostring(root))
    aside.set("Id", "aside")
    etree.SubElement(node, f"{DS}Object").append(aside)
    node.find(f"{DS}SignedInfo/{DS}Reference").set("URI", "#aside")
    next(root.iter(f"{SI}valueXMLList")).text = "1 1 1"
    root.append(node)
    return written(root)


def wrap_document(content: bytes) -> bytes:
    """Wrap the signed document, with its signature, in a certificate with other content."""
    signed = etree.fromstring(content)
    outer = copy.deepcopy(signed)
    outer.remove(outer.find(f"{DS}Signature"))
    outer.replace(outer.find(f"{DCC}measurementResults"), better_results(outer))
    etree.SubElement(outer, f"{DCC}document").append(signed)
    return written(outer)


def signature_in(path: str) -> Forgery:
    def forge(content: bytes) -> bytes:
        root = etree.fromstring(content)
        node = root.find(f"{DS}Signature")
        root.remove(node)
        root.find(path).insert(0, node)
        return written(root)

    return forge


def first(node: Any) -> None:
    node.getparent().insert(0, node)


def twice(node: Any) -> None:
    node.getparent().append(copy.deepcopy(node))


def inside_itself(node: Any) -> None:
    within(f"{DS}Object", copy.deepcopy(node))(node)


def compute_digest_anew(algorithm: str, digest: Callable[[bytes], Any]) -> Forgery:
    """Change the value, and compute its digest again with this algorithm."""

    def forge(content: bytes) -> bytes:
        root = etree.fromstring(content)
        root.find(VALUE).text = "1 1 1"
        bare = copy.deepcopy(root)
        bare.remove(bare.find(f"{DS}Signature"))
        reference = root.find(f".//{DS}Reference")
        reference.find(f"{DS}DigestMethod").set("Algorithm", algorithm)
        value = digest(etree.tostring(bare, method="c14n")).digest()
        reference.find(f"{DS}DigestValue").text = b64encode(value).decode()
        return written(root)

    return forge


def sign_by_public_key(node: Any) -> None:
    """Replace the signature by a message authentication code whose "secret" is the public certificate."""
    import hmac

    info = node.find(f"{DS}SignedInfo")
    method = "http://www.w3.org/2001/04/xmldsig-more#hmac-sha256"
    info.find(f"{DS}SignatureMethod").set("Algorithm", method)
    public = b64decode(node.find(f".//{DS}X509Certificate").text)
    code = hmac.digest(public, etree.tostring(info, method="c14n"), "sha256")
    node.find(f"{DS}SignatureValue").text = b64encode(code).decode()


def pad(node: Any) -> None:
    node.text = node.text[:20] + "\n!" + node.text[20:]


def insert_document_type(declarations: str, outside: str = "") -> Forgery:
    """Insert a document type before the root."""
    document_type = f"<!DOCTYPE x {outside}[{declarations}]>"
    return lambda content: content.replace(b"?>", f"?>{document_type}".encode(), 1)


def use_entity(content: bytes) -> bytes:
    forged = re.sub(rb"(<si:valueXMLList>)\d", rb"\1&e;", content, count=1)
    return insert_document_type('<!ENTITY e "9">')(forged)


def before_root(added: bytes) -> Forgery:
    return lambda content: content.replace(b"?>", b"?>" + added, 1)


def declare(declaration: str, encoding: str) -> Forgery:
    """Return the text with another declaration and encoding."""

    def forge(content: bytes) -> bytes:
        body = content.decode().partition("?>")[2].strip()
        return f"{declaration}{body}".encode(encoding, "xmlcharrefreplace")

    return forge


def swap_prefixes(content: bytes) -> bytes:
    """Exchange the namespaces of two prefixes."""
    one, two = b'xmlns:dcc="https://ptb.de/dcc"', b'xmlns:si="https://ptb.de/si"'
    assert one in content and two in content
    swapped = content.replace(one, b'xmlns:dcc="https://ptb.de/si"', 1)
    return swapped.replace(two, b'xmlns:si="https://ptb.de/dcc"', 1)


def change_start_tag(tag: bytes, added: bytes) -> Forgery:
    return lambda content: re.sub(rb"<" + tag + rb"(?=[ >])", rb"<" + tag + b" " + added, content, count=1)
