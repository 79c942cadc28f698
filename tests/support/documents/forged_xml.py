"""Forgeries of a signed digital certificate: ways to change its message under the existing signature."""

import copy
import re
from base64 import b64encode
from hashlib import sha1, sha256

from lxml import etree

from support.documents.forging_xml import (
    DCC,
    DS,
    SI,
    VALUE,
    XADES,
    Forgery,
    attribute,
    before_root,
    better_results,
    change_signed_info,
    change_start_tag,
    compute_digest_anew,
    declare,
    element,
    first,
    first_last,
    insert_document_type,
    inside_itself,
    pad,
    properties_doubled,
    properties_elsewhere,
    remove,
    replace,
    results_beside,
    sign_by_public_key,
    signature,
    signature_in,
    swap_prefixes,
    text,
    twice,
    use_another,
    use_entity,
    within,
    wrap_content,
    wrap_document,
)

SCRIPT = etree.XML('<script xmlns="http://www.w3.org/1999/xhtml">document.body.textContent = "pass"</script>')
UNSIGNED = etree.XML(
    f'<x:UnsignedProperties xmlns:x="{XADES[1:-1]}"><x:UnsignedSignatureProperties/></x:UnsignedProperties>'
)
MANIFEST = etree.XML(f'<d:Manifest xmlns:d="{DS[1:-1]}"><d:Reference URI=""/></d:Manifest>')
XPATH = etree.XML(
    f'<d:Transform xmlns:d="{DS[1:-1]}" Algorithm="http://www.w3.org/TR/1999/REC-xpath-19991116">'
    "<d:XPath>not(ancestor-or-self::node())</d:XPath></d:Transform>"
)
INCLUDED = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="other.xml"/>'
EXCLUSIVE, WITH_COMMENTS = (
    "http://www.w3.org/2001/10/xml-exc-c14n#",
    "http://www.w3.org/2006/12/xml-c14n11#WithComments",
)

# Alterations of the signed content.
OF_CONTENT: dict[str, Forgery] = {
    "a value": element(VALUE, text("1 1 1")),
    "an uncertainty": element(f".//{SI}uncertaintyXMLList", text("0 0 0")),
    "the number": element(f".//{DCC}uniqueIdentifier", text("RIG-1")),
    "that it is valid": replace(b"valid>false<", b"valid>true<"),
    "that it is simulated": element(f".//{DCC}statement", remove),
    "an order": element(f".//{DCC}statements", first_last),
    "a unit's letter by one that looks the same": replace("°C".encode(), "ºC".encode()),
    "a blank between elements": replace(b"<dcc:administrativeData>", b"<dcc:administrativeData> "),
    "which item it is of": element(f".//{DCC}measurementResult", attribute("refId", "gyroscope-1")),
    "the reason": element(f".//{XADES}Description", text("A calibration certificate")),
    "the time": element(f".//{XADES}SigningTime", text("2020-01-01T00:00:00+00:00")),
    "a second set of results": element("", lambda root: root.insert(2, better_results(root))),
    "an XInclude in a value": element(VALUE, lambda found: found.append(etree.XML(INCLUDED))),
}
# What C14N leaves out, or takes for the same, and namespaces.
OF_FORM: dict[str, Forgery] = {
    "a comment in a value": lambda content: re.sub(rb"(<si:valueXMLList>\d)", rb"\1<!-- -->", content, count=1),
    "a comment that hides a statement": replace(b"<dcc:statement>", b"<!-- x --><dcc:statement>"),
    "a comment before": before_root(b"<!-- valid -->"),
    "a comment behind": lambda content: content + b"<!-- valid -->",
    "a style sheet": before_root(b'<?xml-stylesheet href="other.xsl"?>'),
    "an instruction in a value": lambda content: re.sub(rb"(<si:valueXMLList>\d)", rb"\1<?x?>", content, count=1),
    "an instruction behind": lambda content: content + b"<?verdict pass?>",
    "a document type": insert_document_type('<!ENTITY e "1">'),
    "a document type elsewhere": insert_document_type("", outside='SYSTEM "https://ptb.de.example/dcc.dtd" '),
    "a default for an attribute": insert_document_type(
        '<!ATTLIST dcc:digitalCalibrationCertificate xml:lang CDATA "de">'
    ),
    "a document type with Ids": insert_document_type("<!ATTLIST dcc:item id ID #IMPLIED>"),
    "a value by an entity": use_entity,
    "a namespace that nothing is in": change_start_tag(
        b"dcc:digitalCalibrationCertificate", b'xmlns:x="https://ptb.de/x"'
    ),
    "a default namespace": change_start_tag(b"dcc:digitalCalibrationCertificate", b'xmlns="https://ptb.de/dcc"'),
    "a namespace on an inner element": change_start_tag(b"dcc:measurementResults", b'xmlns:x="https://ptb.de/x"'),
    "a namespace that is relative": change_start_tag(b"dcc:measurementResults", b'xmlns:x="other"'),
    "another namespace of a prefix": replace(b'"https://ptb.de/si"', b'"https://ptb.de/si/"'),
    "prefixes swapped": swap_prefixes,
    "another prefix": lambda content: re.sub(rb"(</?|xmlns:)si(?=[:=])", rb"\1unit", content),
    "a base for addresses": element("", attribute("{http://www.w3.org/XML/1998/namespace}base", "https://ptb.de/")),
    "that blanks count": element("", attribute("{http://www.w3.org/XML/1998/namespace}space", "preserve")),
    "another version of XML": declare('<?xml version="1.1" encoding="UTF-8"?>', "utf-8"),
    "another encoding": declare('<?xml version="1.0" encoding="ISO-8859-1"?>', "latin-1"),
    "an encoding that it is not in": declare('<?xml version="1.0" encoding="UTF-16"?>', "utf-8"),
    "two marks of the byte order": lambda content: b"\xef\xbb\xbf" * 2 + content,
    "UTF-7": declare('<?xml version="1.0" encoding="UTF-7"?>', "utf-7"),
}
# What stands in the signature, or where it stands.
OF_SIGNATURE: dict[str, Forgery] = {
    "results in the signature": signature(results_beside),
    "a text in the signature": signature(within(f"{DS}Object", "The result was replaced: k = 1 1 1")),
    "a script in the signature": signature(within(f"{DS}Object", SCRIPT)),
    "a manifest in the signature": signature(within(f"{DS}Object", MANIFEST)),
    "an empty object": signature(within(f"{DS}Object")),
    "an XInclude in the signature": signature(within(f"{DS}Object", etree.XML(INCLUDED))),
    "something in the object of the properties": element(f".//{DS}Object", within(f"{DCC}comment", "pass")),
    "unsigned properties": element(f".//{XADES}QualifyingProperties", lambda found: found.append(UNSIGNED)),
    "a text between": element(f".//{DS}SignedInfo", lambda found: setattr(found, "tail", "k = 1 1 1")),
    "a blank between": element(f".//{DS}SignedInfo", lambda found: setattr(found, "tail", "\n")),
    "a text behind": signature(lambda found: setattr(found, "tail", "k = 1 1 1")),
    "a text in the object": element(f".//{DS}Object", text("k = 1 1 1")),
    "a comment in the signature": signature(lambda found: found.append(etree.Comment("k = 1 1 1"))),
    "a comment in the signed properties": element(
        f"{'.//'}{XADES}SigningTime", lambda found: found.append(etree.Comment("x"))
    ),
    "an instruction in the signature": signature(lambda found: found.append(etree.PI("verdict", "pass"))),
    "an attribute of the signature": signature(attribute("{https://ptb.de/dcc}verdict", "pass")),
    "a language of the signature": signature(attribute("{http://www.w3.org/XML/1998/namespace}lang", "de")),
    "another name of the signature": signature(attribute("Id", "other")),
    "an attribute of the object": element(f".//{DS}Object", attribute("MimeType", "text/html")),
    "an attribute of the value": element(f".//{DS}SignatureValue", attribute("Id", "value")),
    "another target of the properties": element(f".//{XADES}QualifyingProperties", attribute("Target", "#other")),
    "a namespace on the signature": change_start_tag(b"ds:Signature", b'xmlns:x="https://ptb.de/x"'),
    "a namespace on the object": change_start_tag(b"ds:Object", b'xmlns:x="https://ptb.de/x"'),
    "a namespace on the value": change_start_tag(b"ds:SignatureValue", b'xmlns:x="https://ptb.de/x"'),
    "a default namespace on the object": change_start_tag(b"ds:Object", b'xmlns="https://ptb.de/dcc"'),
    "a second list of certificates": signature(lambda found: found.append(copy.deepcopy(found.find(f"{DS}KeyInfo")))),
    "a name of the key": element(f".//{DS}KeyInfo", within(f"{DS}KeyName", "PTB")),
    "certificates in another order": element(f".//{DS}X509Data", first_last),
    "the signer's certificate": element(f".//{DS}X509Certificate", use_another),
    "other properties of the same Id": signature(properties_doubled),
    "properties moved aside": signature(properties_elsewhere),
    "what is signed moved aside": wrap_content,
    "the signature first": signature(first),
    "the signature twice": signature(twice),
    "the signature in itself": signature(inside_itself),
    "no XML any more": lambda content: content[:-30],
}
# What the signature is made by.
OF_METHOD: dict[str, Forgery] = {
    "a digest": element(f".//{DS}DigestValue", text("QUJD" * 11)),
    "a digest that fits": compute_digest_anew("http://www.w3.org/2001/04/xmlenc#sha256", sha256),
    "a weak digest that fits": compute_digest_anew("http://www.w3.org/2000/09/xmldsig#sha1", sha1),
    "the signature's value": element(f".//{DS}SignatureValue", text("QUJD" * 22)),
    "no value": element(f".//{DS}SignatureValue", text("")),
    "a value of zeros": element(f".//{DS}SignatureValue", text(b64encode(bytes(64)).decode())),
    "signs in the value that no base64 has": element(f".//{DS}SignatureValue", pad),
    "a code by what is public": signature(sign_by_public_key),
    "another method": change_signed_info(
        lambda found: found[1].set("Algorithm", "http://www.w3.org/2000/09/xmldsig#rsa-sha1")
    ),
    "an exclusive form": change_signed_info(lambda found: found[0].set("Algorithm", EXCLUSIVE)),
    "a form with comments": change_signed_info(lambda found: found[0].set("Algorithm", WITH_COMMENTS)),
    "a transform": element(f".//{DS}Transforms", lambda found: found.append(XPATH)),
    "a part alone": element(f".//{DS}Reference", attribute("URI", "#gyroscope-0")),
    "something elsewhere": element(f".//{DS}Reference", attribute("URI", "other.xml")),
    "a reference less": change_signed_info(lambda found: found.remove(found[-1])),
    "a reference more": change_signed_info(lambda found: found.append(copy.deepcopy(found[-1]))),
    "references in another order": change_signed_info(lambda found: found.insert(2, found[-1])),
}
FORGED_XML = OF_CONTENT | OF_FORM | OF_SIGNATURE | OF_METHOD
# Where the signature is no longer that of the document.
MOVED_XML: dict[str, Forgery] = {
    "all but the signature": element(f"{DS}Signature", remove),
    "what is signed inside another": wrap_document,
    "the signature elsewhere": signature_in(f"{DCC}administrativeData"),
}
