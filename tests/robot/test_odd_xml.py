"""XML that is not well formed, but that urdfdom reads, means here what it means there; the doctor makes it well formed."""

from __future__ import annotations

from pathlib import Path

import pinocchio as pin
import pytest
from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

from spacearm.core.errors import FileFormatError
from spacearm.doctor import diagnose, mend_urdf
from spacearm.robot import load_robot
from spacearm.robot.srdf import load_srdf
from support import srdf_text

LIMIT = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
BODY = (
    '<robot name="r">\n<link name="base"/>\n<link name="arm"/>\n<joint name="j" type="revolute"><parent link="base"/>'
    f'<child link="arm"/><axis xyz="0 0 1"/>{LIMIT}</joint>\n%s</robot>\n'
)
PLAIN = BODY % ""

ODD: dict[str, tuple[str, bytes]] = {
    "prefix of an element": ("xml-prefix", (BODY % '<gazebo><sensor:camera name="c"/></gazebo>').encode()),
    "prefix of an attribute": ("xml-prefix", (BODY % '<gazebo xlink:href="c"/>').encode()),
    "prefix declared elsewhere": (
        "xml-prefix",
        (BODY % '<gazebo xmlns:s="urn:x"><s:a/></gazebo><gazebo><s:a/></gazebo>').encode(),
    ),
    "names of many colons": ("xml-prefix", (BODY % "<gazebo><a:b:c/><:x/></gazebo>").encode()),
    "prefix declared as nothing": ("xml-prefix", (BODY % '<gazebo xmlns:a=""/>').encode()),
    "form feed before the root": ("xml-text-outside", b"\x0c" + PLAIN.encode()),
    "doctype inside": ("xml-doctype", (BODY % "<!DOCTYPE q>").encode()),
    "blank line before the declaration": ("xml-declaration", b'\n<?xml version="1.0"?>\n' + PLAIN.encode()),
    "comment before the declaration": ("xml-declaration", b'<!-- x -->\n<?xml version="1.0"?>\n' + PLAIN.encode()),
    "mark, then a blank": ("xml-declaration", b'\xef\xbb\xbf \n<?xml version="1.0"?>\n' + PLAIN.encode()),
    "declaration without a version": ("xml-declaration", b'<?xml encoding="utf-8"?>\n' + PLAIN.encode()),
    "dashes in a comment": ("xml-comment", (BODY % "<!-- old -- do not use ---->").encode()),
    "latin-1 undeclared": ("xml-encoding", (BODY % '<gazebo a="für"/><!-- für -->').encode("latin-1")),
    "latin-1 declared UTF-8": (
        "xml-encoding",
        b'<?xml version="1.0" encoding="UTF-8"?>\n' + (BODY % "<!-- für -->").encode("latin-1"),
    ),
    "encoding of no name": ("xml-encoding", b'<?xml version="1.0" encoding="utf-ate"?>\n' + PLAIN.encode()),
    "encoding that it is not in": ("xml-encoding", b'<?xml version="1.0" encoding="UTF-16"?>\n' + PLAIN.encode()),
    "ampersand in an attribute": ("xml-ampersand", (BODY % '<gazebo a="R&D"/>').encode()),
    "ampersand in a text": ("xml-ampersand", (BODY % "<gazebo>a & b &nbsp; &#0;</gazebo>").encode()),
    "attribute twice": ("xml-attribute-twice", PLAIN.replace('upper="1"', 'upper="1" upper="2"').encode()),
    "no blank between attributes": ("xml-blank", PLAIN.replace('upper="1" ', 'upper="1"').encode()),
    "less-than in an attribute": ("xml-less-than", (BODY % '<gazebo a="1 < 2"/>').encode()),
    "control character": ("xml-control", (BODY % "<gazebo>\x0b</gazebo>").encode()),
    "more after the root": ("xml-text-outside", PLAIN.encode() + b"done.\n"),
    "a second file after the root": ("xml-text-outside", 2 * PLAIN.encode()),
    "doctype": ("xml-doctype", b"<!DOCTYPE robot>\n" + PLAIN.encode()),
}


OLDER = ("comment before the declaration", "attribute twice", "more after the root")
"""Read by older versions of urdfdom, as those of ROS 1 and of Ubuntu 22.04, and no longer."""


@pytest.mark.parametrize("case", ODD)
def test_what_urdfdom_reads_is_read_noted_found_and_mended(case: str, tmp_path: Path) -> None:
    code, text = ODD[case]
    path = tmp_path / "arm.urdf"
    path.write_bytes(text)
    if case not in OLDER:
        assert pin.buildModelFromUrdf(str(path)).upperPositionLimit.tolist() == [1.0]
    robot = load_robot(path, acceleration_limit=1.0)
    assert (robot.dof_names, robot.upper.tolist()) == (("j",), [1.0])
    assert sum("no well-formed XML" in note and "line " in note for note in robot.notes) == 1
    found = [one for one in diagnose(path).findings if one.code == code]
    assert len(found) >= 1
    assert all(one.severity == "warning" and one.mendable and one.line is not None for one in found)
    mended = mend_urdf(path, tmp_path / "copy.urdf")
    assert {change.code for change in mended.changes} == {one.code for one in found}
    assert not [one for one in mended.after.findings if one.code.startswith("xml")]
    etree.fromstring((tmp_path / "copy.urdf").read_bytes())
    again = load_robot(tmp_path / "copy.urdf", acceleration_limit=1.0)
    assert not any("XML" in note for note in again.notes)
    assert pin.buildModelFromUrdf(str(tmp_path / "copy.urdf")).nq == 1


def test_well_formed_xml_is_not_touched(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    for text in (PLAIN.encode(), b'\xef\xbb\xbf<?xml version="1.0"?>' + PLAIN.encode(), PLAIN.encode("utf-16")):
        path.write_bytes(text)
        assert not any("XML" in note for note in load_robot(path).notes)
        assert not [one for one in diagnose(path).findings if one.code.startswith("xml")]


def test_text_before_the_first_element_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text('xacro: in-order processing became default\n<?xml version="1.0"?>\n' + PLAIN)
    assert any("text before the first element (line 1; left out)" in note for note in load_robot(path).notes)
    assert "xml-text-outside" in [one.code for one in diagnose(path).findings]


def test_the_line_is_that_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(BODY % '\n<gazebo a="R&D"/>\n<gazebo b="R&D"/>')
    found = [one.line for one in diagnose(path).findings if one.code == "xml-ampersand"]
    assert found == [6, 7]
    (note,) = (note for note in load_robot(path).notes if "XML" in note)
    assert "(line 6 and 1 more; taken for itself)" in note


ENTITIES = (
    '<!DOCTYPE robot [<!ENTITY a "1">\n<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">\n<!ENTITY f SYSTEM "file:///etc/hostname">]>\n'
)


def test_entities_are_never_expanded(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ENTITIES + PLAIN.replace('upper="1"', 'upper="&a;"'))
    with pytest.raises(FileFormatError, match="upper> is '&a;'"):
        load_robot(path)
    path.write_text(ENTITIES + PLAIN.replace('"arm"', '"&f;&b;"'))
    assert [frame.name for frame in load_robot(path).frames] == ["base", "&f;&b;"]
    bombs = "".join(f'<!ENTITY b{i} "{10 * f"&b{i - 1};"}">' for i in range(1, 30))
    path.write_text(f'<!DOCTYPE robot [<!ENTITY b0 "x">{bombs}]>' + BODY % '<gazebo a="&b29;">&b29;</gazebo>')
    assert load_robot(path).dof == 1


REFUSED = {
    "tags that do not match": PLAIN.replace("</joint>", "</jiont>"),
    "no quotes": PLAIN.replace('upper="1"', "upper=1"),
    "attribute without a value": PLAIN.replace('upper="1"', "upper"),
    "quote that does not end": PLAIN.replace('upper="1"', 'upper="1'),
    "cut off": PLAIN[:-10],
    "comment that does not end": BODY % "<!-- so",
    "xacro": BODY % "<xacro:arm/>",
    "xacro in a number": PLAIN.replace('upper="1"', 'upper="${pi}"'),
    "xacro in a name": PLAIN.replace('"arm"', '"$(arg side)arm"'),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_urdfdom_refuses_or_xacro_left_is_refused(case: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(REFUSED[case])
    with pytest.raises(FileFormatError, match="xacro arm.xacro > arm.urdf" if "xacro" in case else "no XML"):
        load_robot(path)


def test_what_xacro_left_in_how_the_robot_looks_stops_nobody(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(PLAIN.replace('<link name="arm"/>', '<link name="arm"><visual name="${x}"><xacro:grey/></visual></link>'))
    assert load_robot(path).dof == 1


def test_the_doctor_tells_names_that_xacro_left(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(REFUSED["xacro in a name"])
    found = [one for one in diagnose(path).errors if one.code == "xacro-expression"]
    assert len(found) == 2
    assert "xacro arm.xacro > arm.urdf" in found[0].advice


def test_an_srdf_is_read_so_too(tmp_path: Path) -> None:
    path = tmp_path / "arm.srdf"
    path.write_text("\n" + srdf_text.two_arms_srdf().replace("</robot>", "<!-- a -- b --></robot>"))
    found = load_srdf(path)
    assert len(found.groups) == 5
    assert "the SRDF is no well-formed XML" in found.notes[0]
    (tmp_path / "arm.urdf").write_text(srdf_text.two_arms())
    assert found.notes[0] in load_robot(tmp_path / "arm.urdf", srdf=path, group="left").notes
    codes = [one.code for one in diagnose(tmp_path / "arm.urdf", path).findings]
    assert {"xml-comment", "xml-declaration"} <= set(codes)
    path.write_text(srdf_text.srdf(srdf_text.group("${arm}", joints=("left_elbow",))))
    with pytest.raises(FileFormatError, match="xacro"):
        load_srdf(path)
