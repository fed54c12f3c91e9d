"""A robot file as text for tests."""

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
