// Python's arrays and the description of a robot and what is around it.
#pragma once

#include "mechanism/world.hpp"
#include "python/arrays.hpp"
#include "python/bind_convex.hpp"

namespace SPACEARM_NAMESPACE {

// The parts of a world, one Python object each, so that those of a robot can be kept while the scene changes.
struct joints_part {
    std::vector<joint_description> joints;
    int dofs = 0;
};
struct points_part {
    std::vector<point_description> points;
};
struct point_capsules_part {
    std::vector<point_capsule_description> capsules;
};
struct spheres_part {
    std::vector<sphere<double>> spheres;
};
struct envelope_part {
    std::vector<link_body_description> bodies;
    std::vector<solid_description> solids;
    std::vector<std::pair<int, int>> pairs;
    std::shared_ptr<arranged_envelope> arranged = std::make_shared<arranged_envelope>();
};
struct pair_margins_part {
    std::vector<pair_margin_description> margins;
};
struct masses_part {
    std::vector<mass_description> masses;
};
using obstacle_part = std::variant<spheres_part, capsule_description, box_obstacle<double>, cylinder_obstacle<double>,
                                   half_space_obstacle<double>, polytope_description>;

using in_ints = in1<std::int32_t>;
using in_bools = in1<bool>;
using in_pairs = nb::ndarray<const std::int32_t, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using in_places = fixed_array<-1, 3>;

inline void require_lengths(std::size_t n, std::initializer_list<std::size_t> lengths, const char* what) {
    for (std::size_t length : lengths) require(length == n, what);
}

inline joints_part joints_from(in_ints parent, in_bools prismatic, in_ints dof, in1<double> multiplier,
                               in1<double> offset, fixed_array<-1, 3, 3> rotation, in_places translation, int dofs) {
    const std::size_t n = parent.shape(0);
    require_lengths(n,
                    {prismatic.shape(0), dof.shape(0), multiplier.shape(0), offset.shape(0), rotation.shape(0),
                     translation.shape(0)},
                    "the joints' arrays do not fit each other");
    joints_part out{{}, dofs};
    for (std::size_t j = 0; j < n; ++j) {
        joint_description one{parent(j), prismatic(j) ? joint_kind::prismatic : joint_kind::revolute,
                              dof(j),    multiplier(j),
                              offset(j), {},
                              {}};
        std::copy_n(rotation.data() + 9 * j, 9, one.rotation);
        std::copy_n(translation.data() + 3 * j, 3, one.translation);
        out.joints.push_back(one);
    }
    return out;
}
inline points_part points_from(in_ints joint, in_places local) {
    require_lengths(joint.shape(0), {local.shape(0)}, "the points' arrays do not fit each other");
    points_part out;
    for (std::size_t i = 0; i < joint.shape(0); ++i)
        out.points.push_back({joint(i), {local(i, 0), local(i, 1), local(i, 2)}});
    return out;
}
inline point_capsules_part point_capsules_from(in_ints a, in_ints b, in1<double> radius) {
    require_lengths(a.shape(0), {b.shape(0), radius.shape(0)}, "the capsules' arrays do not fit each other");
    point_capsules_part out;
    for (std::size_t i = 0; i < a.shape(0); ++i) out.capsules.push_back({a(i), b(i), radius(i)});
    return out;
}
inline spheres_part spheres_from(in_places center, in1<double> radius) {
    require_lengths(center.shape(0), {radius.shape(0)}, "the spheres' arrays do not fit each other");
    spheres_part out;
    for (std::size_t i = 0; i < center.shape(0); ++i)
        out.spheres.push_back({{center(i, 0), center(i, 1), center(i, 2)}, radius(i)});
    return out;
}
inline solid_description solid_from(const convex_description& shape, in_matrix axes, in_vector origin) {
    solid_description out{shape.kind, {}, shape.radius, shape.vertices, {}, {}};
    std::copy_n(shape.half, 3, out.half);
    for (int k = 0; k < 3; ++k) std::copy_n(axes.data() + 3 * k, 3, out.axis[k]);
    take(origin, out.origin);
    return out;
}
inline envelope_part envelope_from(in_ints joint, in_ints link, in_places a, in_places b, in1<double> radius,
                                   in_pairs pairs, std::optional<in_ints> solid,
                                   std::vector<solid_description> solids) {
    const std::size_t n = joint.shape(0);
    require_lengths(n, {link.shape(0), a.shape(0), b.shape(0), radius.shape(0), solid ? solid->shape(0) : n},
                    "the bodies' arrays do not fit each other");
    envelope_part out;
    out.solids = std::move(solids);
    for (std::size_t i = 0; i < n; ++i) {
        out.bodies.push_back({joint(i),
                              link(i),
                              {a(i, 0), a(i, 1), a(i, 2)},
                              {b(i, 0), b(i, 1), b(i, 2)},
                              radius(i),
                              solid ? (*solid)(i) : -1});
    }
    for (std::size_t i = 0; i < pairs.shape(0); ++i) out.pairs.push_back({pairs(i, 0), pairs(i, 1)});
    return out;
}
inline pair_margins_part pair_margins_from(in_ints body, in_ints obstacle, in_ints other, in1<double> margin) {
    require_lengths(body.shape(0), {obstacle.shape(0), other.shape(0), margin.shape(0)},
                    "the margins' arrays do not fit each other");
    pair_margins_part out;
    for (std::size_t i = 0; i < body.shape(0); ++i) out.margins.push_back({body(i), obstacle(i), other(i), margin(i)});
    return out;
}
inline masses_part masses_from(in1<double> mass, in_places com, fixed_array<-1, 6> inertia) {
    require_lengths(mass.shape(0), {com.shape(0), inertia.shape(0)}, "the masses' arrays do not fit each other");
    masses_part out;
    for (std::size_t i = 0; i < mass.shape(0); ++i) {
        mass_description one{mass(i), {}, {}};
        std::copy_n(com.data() + 3 * i, 3, one.com);
        std::copy_n(inertia.data() + 6 * i, 6, one.inertia);
        out.masses.push_back(one);
    }
    return out;
}

inline void add_obstacles(const obstacle_part& part, std::vector<obstacle_description>& all) {
    std::visit(
        [&](const auto& one) {
            if constexpr (std::is_same_v<std::decay_t<decltype(one)>, spheres_part>)
                all.insert(all.end(), one.spheres.begin(), one.spheres.end());
            else all.push_back(one);
        },
        part);
}

// A part that is made by one function of keyword arguments.
template <class Part, class... In, class... Names>
void bind_part(nb::module_& m, const char* name, const char* doc, Part (*make)(In...), Names... names) {
    nb::class_<Part>(m, name, doc)
        .def(
            "__init__", [make](Part* self, In... given) { new (self) Part(make(std::move(given)...)); }, nb::kw_only(),
            names...);
}

inline capsule_description capsule_from(in_vector a, in_vector b, double radius) {
    capsule_description out{{}, {}, radius};
    take(a, out.a);
    take(b, out.b);
    return out;
}
inline box_obstacle<double> box_from(in_vector center, in_matrix axes, in_vector half_size, double rounding) {
    box_obstacle<double> out{};
    take(center, out.center);
    for (int k = 0; k < 3; ++k) std::copy_n(axes.data() + 3 * k, 3, out.axis[k]);
    take(half_size, out.half);
    out.rounding = rounding;
    return out;
}
inline cylinder_obstacle<double> cylinder_from(in_vector center, in_vector axis, double half_length, double radius,
                                               double rounding) {
    cylinder_obstacle<double> out{{}, {}, half_length, radius, rounding};
    take(center, out.center);
    take(axis, out.axis);
    return out;
}
inline half_space_obstacle<double> half_space_from(in_vector normal, double offset) {
    half_space_obstacle<double> out{{}, offset};
    take(normal, out.normal);
    return out;
}

inline polytope_description polytope_from(in_places vertices, double rounding) {
    polytope_description out{{}, rounding};
    for (std::size_t i = 0; i < vertices.shape(0); ++i)
        out.vertices.push_back({vertices(i, 0), vertices(i, 1), vertices(i, 2)});
    return out;
}

inline void bind_world(nb::module_& m) {
    bind_part(m, "Joints", "The joints, parents before children; values are multiplier * q[dof] + offset.",
              &joints_from, "parent"_a, "prismatic"_a, "dof"_a, "multiplier"_a, "offset"_a, "rotation"_a,
              "translation"_a, "dofs"_a);
    bind_part(m, "Points", "Points, each in the frame of the joint that carries it; -1: the base.", &points_from,
              "joint"_a, "local"_a);
    bind_part(m, "PointCapsules", "Capsules between two points each, by the points' indices.", &point_capsules_from,
              "a"_a, "b"_a, "radius"_a);
    bind_part(m, "Spheres", "Spheres: as many obstacles.", &spheres_from, "center"_a, "radius"_a);
    bind_part(m, "Capsule", "An obstacle: a segment from a to b, with a radius.", &capsule_from, "a"_a, "b"_a,
              "radius"_a);
    bind_part(m, "Box", "An obstacle; `axes` has its x, y and z axis as rows.", &box_from, "center"_a, "axes"_a,
              "half_size"_a, "rounding"_a = 0.0);
    bind_part(m, "Cylinder", "An obstacle: a cylinder with flat ends.", &cylinder_from, "center"_a, "axis"_a,
              "half_length"_a, "radius"_a, "rounding"_a = 0.0);
    bind_part(m, "Polytope", "An obstacle: the hull of its vertices (k, 3).", &polytope_from, "vertices"_a,
              "rounding"_a = 0.0);
    bind_part(m, "Solid",
              "A body of a link that is no capsule: a shape, and where its own axes (as rows) and origin are in the "
              "frame of the joint.",
              &solid_from, "shape"_a, "axes"_a, "origin"_a);
    bind_part(m, "HalfSpace", "An obstacle: solid where normal . x <= offset.", &half_space_from, "normal"_a,
              "offset"_a);
    bind_part(m, "Envelope",
              "The bodies of the links, each in the frame of its joint, and pairs of links to keep clear of each "
              "other. A body "
              "is a capsule from a to b, or the one of `solids` that `solid` says; -1: none.",
              &envelope_from, "joint"_a, "link"_a, "a"_a, "b"_a, "radius"_a, "pairs"_a, "solid"_a = nb::none(),
              "solids"_a = std::vector<solid_description>());
    bind_part(m, "PairMargins",
              "Margins of pairs, lower or higher than that of all others [m]: of a body and an obstacle, or another "
              "body where the obstacle is -1. Bodies are those of the envelope, obstacles the kernel's. A margin holds "
              "for all of the body's link, so all bodies of a link have the same one; of one pair the last counts.",
              &pair_margins_from, "body"_a, "obstacle"_a, "other"_a, "margin"_a);
    bind_part(m, "Masses",
              "The masses of the base and of each joint's body, in that joint's frame; inertia about the "
              "centre of mass: xx, yy, zz, xy, xz, yz.",
              &masses_from, "mass"_a, "com"_a, "inertia"_a);
    nb::class_<world>(m, "World", "A robot and what is around it: what a model is built from.")
        .def(
            "__init__",
            [](world* self, const joints_part& joints, const points_part* points, const point_capsules_part* capsules,
               const spheres_part* spheres, const envelope_part* envelope, const std::vector<obstacle_part>& obstacles,
               const pair_margins_part* margins, const masses_part* masses) {
                world made;
                made.dofs = joints.dofs;
                made.joints = joints.joints;
                if (points) made.points = points->points;
                if (capsules) made.point_capsules = capsules->capsules;
                if (spheres) made.point_spheres = spheres->spheres;
                if (envelope) {
                    made.link_bodies = envelope->bodies;
                    made.solids = envelope->solids;
                    made.link_pairs = envelope->pairs;
                    made.arranged = envelope->arranged;
                }
                for (const obstacle_part& part : obstacles) add_obstacles(part, made.obstacles);
                if (margins) made.pair_margins = margins->margins;
                if (masses) made.masses = masses->masses;
                new (self) world(std::move(made));
            },
            nb::kw_only(), "joints"_a, "points"_a = nb::none(), "point_capsules"_a = nb::none(),
            "point_spheres"_a = nb::none(), "envelope"_a = nb::none(), "obstacles"_a = nb::make_tuple(),
            "pair_margins"_a = nb::none(), "masses"_a = nb::none());
}

}  // namespace SPACEARM_NAMESPACE
