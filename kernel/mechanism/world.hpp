// The description of a robot and what is around it, in double; and the one function that builds a model of it.
//
// A description is plain data, in any order. `build` checks all of it, and does what has to be done in its only right
// order: joints, points, the capsules between them, the envelope, the obstacles' tree, the margins of pairs, the
// columns that are needed, the masses. What does not fit raises std::invalid_argument.
#pragma once

#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <variant>

#include "checks.hpp"
#include "mechanism/model.hpp"

namespace SPACEARM_NAMESPACE {

inline constexpr double most_of_masses = 1e18;  // [kg], [kg m^2]
inline constexpr int most_dofs = 1 << 16;

struct joint_description {
    int parent = -1;  // -1: the base; parents come before children
    joint_kind kind = joint_kind::revolute;
    int dof = 0;                        // which entry of q drives it
    double multiplier = 1, offset = 0;  // value = multiplier * q[dof] + offset
    double rotation[9] = {};            // row-major, from this joint's frame at q = 0 to the parent's
    double translation[3] = {};         // [m]
};
struct point_description {
    int joint = -1;
    double local[3] = {};  // [m] in the joint's frame
};
struct point_capsule_description {
    int a = 0, b = 0;  // indices of points, both on one rigid body
    double radius = 0;
};
struct link_body_description {
    int joint = -1, link = 0;  // bodies of one link and joint are arranged together
    double a[3] = {}, b[3] = {}, radius = 0;
    int solid = -1;  // which of the solids it is; -1: a capsule
};
struct polytope_description {
    std::vector<std::array<double, 3>> vertices;
    double rounding = 0;
};
struct capsule_description {
    double a[3] = {}, b[3] = {}, radius = 0;
};
using obstacle_description = std::variant<sphere<double>, capsule_description, box_obstacle<double>,
                                          cylinder_obstacle<double>, half_space_obstacle<double>, polytope_description>;
// The margin of one pair, lower or higher than that of all others: of a body's link and an obstacle, or another body's
// link where the obstacle is -1.
struct pair_margin_description {
    int body = 0, obstacle = -1, other = -1;
    double margin = 0;  // [m]
};
struct mass_description {
    double mass = 0, com[3] = {}, inertia[6] = {};  // [kg], [m], about it [kg m^2]: xx, yy, zz, xy, xz, yz
};

// The envelope as models have it, kept for all worlds of one robot: its bounding spheres take longer than all else.
struct arranged_envelope {
    template <class T> struct of {
        int joints = -1;  // that the robot has; -1: not made yet
        link_envelope<T> envelope;
    };
    std::tuple<of<float>, of<double>> made;
};

struct world {
    int dofs = 0;
    std::vector<joint_description> joints;
    std::vector<point_description> points;
    std::vector<point_capsule_description> point_capsules;
    std::vector<sphere<double>> point_spheres;  // the paper's obstacles, for the point capsules
    std::vector<link_body_description> link_bodies;
    std::vector<solid_description> solids;        // of the links
    std::vector<std::pair<int, int>> link_pairs;  // links that must keep clear of each other
    std::vector<obstacle_description> obstacles;
    std::vector<pair_margin_description> pair_margins;
    std::vector<mass_description> masses;         // of the base, then of each joint; empty: not known
    std::shared_ptr<arranged_envelope> arranged;  // of these bodies, solids and pairs; none: not kept
};

// ---- its parts ------------------------------------------------------------------------------------------------------
template <class T, std::size_t N> void copy_numbers(const double (&from)[N], T (&to)[N]) {
    for (std::size_t k = 0; k < N; ++k) to[k] = static_cast<T>(from[k]);
}

template <class T> void build_joints(const world& given, model<T>& m) {
    require(given.dofs >= 1 && given.dofs <= most_dofs, "no degree of freedom, or too many");
    m.robot.dofs = given.dofs;
    for (const joint_description& j : given.joints) {
        require(j.parent < static_cast<int>(m.robot.joints.size()) && j.parent >= -1, "parents come before children");
        require(j.dof >= 0 && j.dof < given.dofs, "a joint's degree of freedom is out of range");
        require(within(j.multiplier, widest) && within(j.offset, widest) && all_within(j.rotation, widest)
                    && all_within(j.translation, widest),
                "a joint's number that is none, or too large");
        m.robot.joints.push_back(
            make_joint<T>(j.parent, j.kind, j.dof, j.multiplier, j.offset, j.rotation, j.translation));
    }
}

template <class T> void build_points(const world& given, model<T>& m) {
    const int joints = static_cast<int>(m.robot.joints.size()), points = static_cast<int>(given.points.size());
    for (const point_description& p : given.points) {
        require(p.joint >= -1 && p.joint < joints, "a point's joint is out of range");
        require(all_within(p.local, widest), "a point's number that is none, or too large");
        m.points.push_back({p.joint, {}});
        copy_numbers(p.local, m.points.back().local);
    }
    for (const point_capsule_description& c : given.point_capsules) {
        require(c.a >= 0 && c.a < points && c.b >= 0 && c.b < points, "a capsule's point is out of range");
        require(within(c.radius, widest), "a radius that is none, or too large");
        m.capsules.push_back({c.a, c.b, static_cast<T>(c.radius), T(0)});
    }
    for (const sphere<double>& s : given.point_spheres) {
        require(all_within(s.center, widest) && within(s.radius, widest),
                "a sphere's number that is none, or too large");
        m.spheres.push_back({{}, static_cast<T>(s.radius)});
        copy_numbers(s.center, m.spheres.back().center);
    }
    if (m.capsules.empty()) return;
    // Both ends move with one body, though they may be named by two joints whose origins coincide: measured at q = 0.
    std::vector<unsigned> used(m.robot.joints.size(), 7);
    mark_needed(m.robot, used);
    workspace<T> w(m);
    std::vector<pack<T>> zero(m.robot.dofs, pack<T>(T(0)));
    place(m, zero.data(), w);
    for (std::size_t i = 0; i < m.capsules.size(); ++i) {
        T squared[lanes_of<T>];
        dot(w.axis[i], w.axis[i]).store(squared);
        m.capsules[i].inverse_squared_length = squared[0] > T(0) ? T(1) / squared[0] : T(0);
    }
}

template <class T> void build_solids(const world& given, model<T>& m) {
    for (const solid_description& s : given.solids) {
        bool sound = all_within(s.half, widest) && all_within(s.origin, widest) && within(s.radius, widest);
        for (const auto& numbers : s.axis) sound = sound && all_within(numbers, widest);
        for (const auto& v : s.vertices) sound = sound && all_within(v, widest);
        require(sound, "a body's number that is none, or too large");
        require((s.kind == core_kind::polytope) == !s.vertices.empty(),
                "a polytope has vertices, and nothing else has");
        m.envelope.solids.push_back(make_solid<T>(s));
    }
}

// The bodies link by link, each link's in clusters, and the pairs of clusters that must keep clear.
template <class T> void build_envelope(const world& given, model<T>& m) {
    const int solids = static_cast<int>(given.solids.size());
    const int joints = static_cast<int>(m.robot.joints.size()), count = static_cast<int>(given.link_bodies.size());
    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int i, int k) { return given.link_bodies[i].link < given.link_bodies[k].link; });
    std::vector<std::vector<int>> clusters_of;  // by link
    for (int first = 0; first < count;) {
        const link_body_description& head = given.link_bodies[order[first]];
        require(head.link >= 0 && head.link < count, "a link is out of range");
        int last = first;
        for (; last < count; ++last) {
            const link_body_description& c = given.link_bodies[order[last]];
            if (c.link != head.link || c.joint != head.joint) break;
            require(c.joint >= -1 && c.joint < joints, "a body's joint is out of range");
            require(c.solid >= -1 && c.solid < solids, "a body's solid is out of range");
            require(all_within(c.a, widest) && all_within(c.b, widest) && within(c.radius, widest),
                    "a capsule's number that is none, or too large");
            m.envelope.bodies.push_back(c.solid < 0 ? make_link_body<T>(c.a, c.b, c.radius)
                                                    : make_link_body(m.envelope.solids[c.solid], c.solid));
            m.envelope.bodies.back().index = order[last];
        }
        if (head.link >= static_cast<int>(clusters_of.size())) clusters_of.resize(head.link + 1);
        make_clusters(m.envelope, head.joint, first, last, clusters_of[head.link]);
        first = last;
    }
    const int links = static_cast<int>(clusters_of.size());
    for (const auto& [one, two] : given.link_pairs) {
        require(one >= 0 && two >= 0 && one < links && two < links && one != two, "a pair's link is out of range");
        for (int x : clusters_of[one]) {
            for (int y : clusters_of[two]) m.envelope.pairs.push_back({x, y});
        }
    }
}

// The same, or a copy of what was made for this robot before.
template <class T> void build_links(const world& given, model<T>& m) {
    const int joints = static_cast<int>(m.robot.joints.size());
    arranged_envelope::of<T>* kept =
        given.arranged ? &std::get<arranged_envelope::of<T>>(given.arranged->made) : nullptr;
    if (kept && kept->joints == joints) {
        m.envelope = kept->envelope;
        return;
    }
    build_solids(given, m);
    build_envelope(given, m);
    if (kept) *kept = {joints, m.envelope};
}

// Each obstacle in the model's scalar; returns its centre.
template <class T> std::array<T, 3> add_obstacle(const sphere<double>& o, obstacle_set<T>& all) {
    require(all_within(o.center, widest) && within(o.radius, widest), "a sphere's number that is none, or too large");
    all.spheres.push_back({{}, static_cast<T>(o.radius)});
    copy_numbers(o.center, all.spheres.back().center);
    return {T(o.center[0]), T(o.center[1]), T(o.center[2])};
}
template <class T> std::array<T, 3> add_obstacle(const capsule_description& o, obstacle_set<T>& all) {
    require(all_within(o.a, widest) && all_within(o.b, widest) && within(o.radius, widest),
            "a capsule's number that is none, or too large");
    capsule_obstacle<T> made{};
    double squared = 0;
    std::array<T, 3> center;
    for (int k = 0; k < 3; ++k) {
        made.a[k] = static_cast<T>(o.a[k]);
        made.ab[k] = static_cast<T>(o.b[k] - o.a[k]);
        squared += (o.b[k] - o.a[k]) * (o.b[k] - o.a[k]);
        center[k] = static_cast<T>((o.a[k] + o.b[k]) / 2);
    }
    made.inverse_squared_length = squared > 0 ? static_cast<T>(1 / squared) : T(0);
    made.radius = static_cast<T>(o.radius);
    all.capsules.push_back(made);
    return center;
}
template <class T> std::array<T, 3> add_obstacle(const box_obstacle<double>& o, obstacle_set<T>& all) {
    bool sound = all_within(o.center, widest) && all_within(o.half, widest) && within(o.rounding, widest);
    for (const auto& axis : o.axis) sound = sound && all_within(axis, widest);
    require(sound, "a box's number that is none, or too large");
    box_obstacle<T> made{};
    copy_numbers(o.center, made.center);
    for (int k = 0; k < 3; ++k) copy_numbers(o.axis[k], made.axis[k]);
    copy_numbers(o.half, made.half);
    made.rounding = static_cast<T>(o.rounding);
    all.boxes.push_back(made);
    return {made.center[0], made.center[1], made.center[2]};
}
template <class T> std::array<T, 3> add_obstacle(const cylinder_obstacle<double>& o, obstacle_set<T>& all) {
    require(all_within(o.center, widest) && all_within(o.axis, widest) && within(o.half_length, widest)
                && within(o.radius, widest) && within(o.rounding, widest),
            "a cylinder's number that is none, or too large");
    cylinder_obstacle<T> made{};
    copy_numbers(o.center, made.center);
    copy_numbers(o.axis, made.axis);
    made.half_length = static_cast<T>(o.half_length);
    made.radius = static_cast<T>(o.radius);
    made.rounding = static_cast<T>(o.rounding);
    all.cylinders.push_back(made);
    return {made.center[0], made.center[1], made.center[2]};
}
template <class T> std::array<T, 3> add_obstacle(const half_space_obstacle<double>& o, obstacle_set<T>& all) {
    require(all_within(o.normal, widest) && within(o.offset, widest),
            "a half-space's number that is none, or too large");
    half_space_obstacle<T> made{};
    copy_numbers(o.normal, made.normal);
    made.offset = static_cast<T>(o.offset);
    all.half_spaces.push_back(made);
    return {static_cast<T>(o.offset * o.normal[0]), static_cast<T>(o.offset * o.normal[1]),
            static_cast<T>(o.offset * o.normal[2])};  // of those in it, the nearest to the origin
}
template <class T> std::array<T, 3> add_obstacle(const polytope_description& o, obstacle_set<T>& all) {
    require(!o.vertices.empty(), "a polytope without vertices");
    for (const auto& v : o.vertices) require(all_within(v, widest), "a vertex's number that is none, or too large");
    require(within(o.rounding, widest), "a rounding that is none, or too large");
    all.polytopes.push_back(make_polytope_obstacle<T>(o.vertices, o.rounding));
    const T(&center)[3] = all.polytopes.back().center;
    return {center[0], center[1], center[2]};
}
inline shape shape_of(const obstacle_description& o) {
    constexpr shape of[] = {shape::sphere,   shape::capsule,    shape::box,
                            shape::cylinder, shape::half_space, shape::polytope};
    return of[o.index()];
}
template <class T> void build_obstacles(const world& given, model<T>& m) {
    for (const obstacle_description& o : given.obstacles) {
        m.obstacle_centers.push_back(std::visit([&](const auto& one) { return add_obstacle(one, m.obstacles); }, o));
        m.obstacle_order.push_back({shape_of(o), static_cast<int>(m.obstacles.count(shape_of(o))) - 1});
    }
    m.obstacles.build_tree();
}

// In which cluster each body is, and where each obstacle is in the tree, both as they were given.
template <class T> void build_places(model<T>& m) {
    const link_envelope<T>& b = m.envelope;
    m.cluster_of.assign(b.bodies.size(), 0);
    for (std::size_t c = 0; c < b.clusters.size(); ++c) {
        for (int i = b.clusters[c].first; i < b.clusters[c].last; ++i)
            m.cluster_of[b.bodies[i].index] = static_cast<int>(c);
    }
    std::map<std::pair<shape, int>, int> node_of;
    for (std::size_t k = 0; k < m.obstacles.tree.size(); ++k)
        node_of[{m.obstacles.tree[k].kind, m.obstacles.tree[k].index}] = static_cast<int>(k);
    for (const auto& one : m.obstacle_order) m.node_of.push_back(node_of.at(one));
}

// Margins of pairs of bodies become those of their clusters: with a node of the obstacles' tree, or another cluster.
// Of one pair the last one given counts.
template <class T> void build_pair_margins(const world& given, model<T>& m) {
    link_envelope<T>& b = m.envelope;
    const int bodies = static_cast<int>(b.bodies.size()), obstacles = static_cast<int>(m.obstacle_order.size());
    std::map<std::pair<int, int>, int> number_of;  // of each pair of clusters
    for (std::size_t p = 0; p < b.pairs.size(); ++p) {
        const auto& [x, y] = b.pairs[p];
        number_of[{std::min(x, y), std::max(x, y)}] = static_cast<int>(p);
    }
    std::map<std::pair<int, int>, T> margins;
    for (const auto& [body, obstacle, other, margin] : given.pair_margins) {
        require(body >= 0 && body < bodies && obstacle < obstacles && other < bodies && (obstacle >= 0 || other >= 0),
                "a pair's margin is of a pair out of range");
        require(within(margin, widest), "a pair's margin that is none, or too large");
        const int one = m.cluster_of[body];
        if (obstacle >= 0) {
            margins[{one, m.node_of[obstacle]}] = static_cast<T>(margin);
            continue;
        }
        const int two = m.cluster_of[other];
        const auto at = number_of.find({std::min(one, two), std::max(one, two)});
        if (at != number_of.end()) margins[{-1, at->second}] = static_cast<T>(margin);
    }
    for (const auto& [pair, margin] : margins) {  // in order
        b.pair_margins.push_back({pair.first, pair.second, margin});
        if (pair.first < 0) continue;
        T& greatest = b.clusters[pair.first].greatest_margin;
        greatest = std::max(greatest, margin);
    }
}

// The columns that points and envelope need; a base that floats needs all of them, and remembers these.
template <class T> void mark_columns(model<T>& m) {
    std::vector<unsigned> used(m.robot.joints.size(), 0);
    const auto use = [&](int j, const T* local) {
        for (int k = 0; j >= 0 && k < 3; ++k) used[j] |= local[k] != T(0) ? 1u << k : 0u;
    };
    for (const point<T>& p : m.points) use(p.joint, p.local);
    for (const cluster<T>& c : m.envelope.clusters) {
        use(c.joint, c.center);
        for (int i = c.first; i < c.last; ++i) {
            const link_body<T>& body = m.envelope.bodies[i];
            for (const T* local : {body.a, body.ab, body.middle}) use(c.joint, local);
            if (body.solid >= 0 && c.joint >= 0) used[c.joint] = 7;
        }
    }
    mark_needed(m.robot, used);
}
template <class T> void build_masses(const world& given, model<T>& m) {
    if (given.masses.empty()) return;
    require(given.masses.size() == m.robot.joints.size() + 1, "masses are one of the base and one of each joint");
    double total = 0;
    for (const mass_description& one : given.masses) {
        require(within(one.mass, most_of_masses) && all_within(one.com, widest)
                    && all_within(one.inertia, most_of_masses),
                "a mass's number that is none, or too large");
        total += one.mass;
    }
    require(total > 0, "no mass");
    const mass_description& base = given.masses.front();
    m.masses.total = static_cast<T>(total);
    copy_numbers(base.com, m.masses.about);
    copy_numbers(base.inertia, m.masses.second);
    for (std::size_t j = 0; j < m.robot.joints.size(); ++j) {
        const mass_description& one = given.masses[j + 1];
        m.masses.joints.push_back(make_mass<T>(one.mass, one.com, one.inertia));
        m.shape_columns.push_back(m.robot.joints[j].needed);
        m.robot.joints[j].needed = 7;
    }
}

// ---- the whole ------------------------------------------------------------------------------------------------------
template <class T> model<T> build(const world& given) {
    model<T> m;
    build_joints(given, m);
    build_points(given, m);
    build_links(given, m);
    build_obstacles(given, m);
    build_places(m);
    build_pair_margins(given, m);
    mark_columns(m);
    build_masses(given, m);
    return m;
}

}  // namespace SPACEARM_NAMESPACE
