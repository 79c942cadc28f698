"""Tools to forge a signed digital certificate: changes of its text, its tree and its signature."""

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


def replaced(old: bytes, new: bytes) -> Forgery:
    def forge(content: bytes) -> bytes:
        assert old in content
        return content.replace(old, new, 1)

    return forge


def element(path: str, change: Callable[[Any], object]) -> Forgery:
    """The first element of this path changed."""

    def forge(content: bytes) -> bytes:
        root = etree.fromstring(content)
        found = root.find(path) if path else root
        assert found is not None, path
        change(found)
        return written(root)

    return forge


def signature(change: Callable[[Any], object]) -> Forgery:
    return element(f"{DS}Signature", change)


def signed_info(change: Callable[[Any], object]) -> Forgery:
    return element(f".//{DS}SignedInfo", change)


def text(new: str) -> Callable[[Any], None]:
    def change(found: Any) -> None:
        assert found.text != new
        found.text = new

    return change


def attribute(name: str, value: str) -> Callable[[Any], None]:
    return lambda found: found.set(name, value)


def within(tag: str, inside: str | Any | None = None, **attributes: str) -> Callable[[Any], None]:
    """One more element at the end of one, holding a text or another element."""

    def change(found: Any) -> None:
        added = etree.SubElement(found, tag, **attributes)
        if isinstance(inside, str):
            added.text = inside
        elif inside is not None:
            added.append(copy.deepcopy(inside))

    return change


def removed(found: Any) -> None:
    found.getparent().remove(found)


def first_last(found: Any) -> None:
    found.append(found[0])


def better_results(root: Any) -> Any:
    """The set of results with other numbers."""
    results = copy.deepcopy(root.find(f"{DCC}measurementResults"))
    for value in results.iter(f"{SI}valueXMLList"):
        value.text = "1 1 1"
    return results


def of_another(found: Any) -> None:
    stranger = holder("Laboratory", holder("Authority")).certificates().decode()
    found.text = stranger.split("-----")[2]


def results_beside(found: Any) -> None:
    """The one that real_world.md tells of: a second set of results in an Object of the signature."""
    within(f"{DS}Object", better_results(found.getroottree().getroot()))(found)


def properties_doubled(found: Any) -> None:
    """Other properties of the same Id, before those that are signed."""
    other = copy.deepcopy(found.find(f".//{XADES}SignedProperties"))
    other.find(f".//{XADES}Description").text = "A calibration certificate"
    holder_ = etree.Element(f"{DS}Object")
    holder_.append(other)
    found.insert(0, holder_)


def properties_elsewhere(found: Any) -> None:
    """What is signed moved into another Object, and other properties in its place."""
    signed = found.find(f".//{XADES}SignedProperties")
    other = copy.deepcopy(signed)
    other.set("Id", "other")
    other.find(f".//{XADES}Description").text = "A calibration certificate"
    signed.getparent().replace(signed, other)
    etree.SubElement(found, f"{DS}Object").append(signed)


def wrapped(content: bytes) -> bytes:
    """What was signed is moved aside, under a name, and something else stands in its place."""
    root = etree.fromstring(content)
    found = root.find(f"{DS}Signature")
    found.getparent().remove(found)
    aside = etree.fromstring(etree.tostring(root))
    aside.set("Id", "aside")
    etree.SubElement(found, f"{DS}Object").append(aside)
    found.find(f"{DS}SignedInfo/{DS}Reference").set("URI", "#aside")
    next(root.iter(f"{SI}valueXMLList")).text = "1 1 1"
    root.append(found)
    return written(root)


def wrapped_around(content: bytes) -> bytes:
    """All of what was signed, signature included, inside a certificate that says something else."""
    signed = etree.fromstring(content)
    outer = copy.deepcopy(signed)
    outer.remove(outer.find(f"{DS}Signature"))
    outer.replace(outer.find(f"{DCC}measurementResults"), better_results(outer))
    etree.SubElement(outer, f"{DCC}document").append(signed)
    return written(outer)


def signature_in(path: str) -> Forgery:
    def forge(content: bytes) -> bytes:
        root = etree.fromstring(content)
        found = root.find(f"{DS}Signature")
        root.remove(found)
        root.find(path).insert(0, found)
        return written(root)

    return forge


def first(found: Any) -> None:
    found.getparent().insert(0, found)


def twice(found: Any) -> None:
    found.getparent().append(copy.deepcopy(found))


def inside_itself(found: Any) -> None:
    within(f"{DS}Object", copy.deepcopy(found))(found)


def redigested(algorithm: str, digest: Callable[[bytes], Any]) -> Forgery:
    """The value changed, and the digest made again to fit it, under this algorithm."""

    def forge(content: bytes) -> bytes:
        root = etree.fromstring(content)
        root.find(VALUE).text = "1 1 1"
        bare = copy.deepcopy(root)
        bare.remove(bare.find(f"{DS}Signature"))
        reference = root.find(f".//{DS}Reference")
        reference.find(f"{DS}DigestMethod").set("Algorithm", algorithm)
        made = digest(etree.tostring(bare, method="c14n")).digest()
        reference.find(f"{DS}DigestValue").text = b64encode(made).decode()
        return written(root)

    return forge


def keyed_by_what_is_public(found: Any) -> None:
    """A message authentication code in place of a signature: its "secret" would be the certificate."""
    import hmac

    info = found.find(f"{DS}SignedInfo")
    method = "http://www.w3.org/2001/04/xmldsig-more#hmac-sha256"
    info.find(f"{DS}SignatureMethod").set("Algorithm", method)
    public = b64decode(found.find(f".//{DS}X509Certificate").text)
    made = hmac.digest(public, etree.tostring(info, method="c14n"), "sha256")
    found.find(f"{DS}SignatureValue").text = b64encode(made).decode()


def padded(found: Any) -> None:
    found.text = found.text[:20] + "\n!" + found.text[20:]


def typed(declarations: str, outside: str = "") -> Forgery:
    """A document type before the root."""
    document_type = f"<!DOCTYPE x {outside}[{declarations}]>"
    return lambda content: content.replace(b"?>", f"?>{document_type}".encode(), 1)


def by_entity(content: bytes) -> bytes:
    forged = re.sub(rb"(<si:valueXMLList>)\d", rb"\1&e;", content, count=1)
    return typed('<!ENTITY e "9">')(forged)


def before_root(added: bytes) -> Forgery:
    return lambda content: content.replace(b"?>", b"?>" + added, 1)


def declared(declaration: str, encoding: str) -> Forgery:
    """The text under another declaration and in another encoding."""

    def forge(content: bytes) -> bytes:
        body = content.decode().partition("?>")[2].strip()
        return f"{declaration}{body}".encode(encoding, "xmlcharrefreplace")

    return forge


def swapped_names(content: bytes) -> bytes:
    """Each of two prefixes for the other's names."""
    one, two = b'xmlns:dcc="https://ptb.de/dcc"', b'xmlns:si="https://ptb.de/si"'
    assert one in content and two in content
    swapped = content.replace(one, b'xmlns:dcc="https://ptb.de/si"', 1)
    return swapped.replace(two, b'xmlns:si="https://ptb.de/dcc"', 1)


def on_start_tag(of: bytes, added: bytes) -> Forgery:
    return lambda content: re.sub(rb"<" + of + rb"(?=[ >])", rb"<" + of + b" " + added, content, count=1)
