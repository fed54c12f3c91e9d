"""Robot files as text for tests."""

ARM = """\
spacearm-robot: 1
name: arm
link_radius: 0.1
joints:
  - {name: shoulder, kind: revolute, parent: base, child: upper, axis: [0, 0, 1],
     lower: -1, upper: 1, velocity: 2}
  - {name: lift, kind: prismatic, parent: upper, child: fore,
     xyz: [1, 0, 0], rpy_deg: [90, 0, 0], axis: [0, 0, 1],
     lower: 0, upper: 1, velocity: 1, acceleration: 3}
  - {name: mount, kind: fixed, parent: fore, child: hand, xyz: [0, 0, 1]}
capsules:
  - {link: upper, from: [0, 0, 0], to: [1, 0, 0]}
  - {link: hand, from: [0, 0, 0], to: [0, 0, 0], radius: 0.2}
"""

FLOATING = (
    ARM.replace("link_radius", "base: floating\nlink_radius")
    + """\
boxes:
  - {link: base, size: [2, 1, 0.5], xyz: [0, 0, -1], rpy_deg: [0, 0, 90], capsules: 4}
  - {link: hand, size: [0.1, 0.1, 0.1]}
masses:
  - {link: base, mass: 100, com: [0, 0, -1], inertia: [10, 20, 25, 1, 2, 3]}
  - {link: hand, mass: 2, inertia: [0.1, 0.1, 0.1, 0, 0, 0]}
configurations:
  - {name: home, q: [0.5, 0.25]}
self_collision: [[base, hand]]
"""
)
