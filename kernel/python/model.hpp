// Python's arrays and the kernel's model: robots, envelopes, obstacles. Arrays come checked from Python, so what is
// wrong here is a defect of ours and raises ValueError.
#pragma once

#include <map>

#include "mechanism/model.hpp"
#include "python/arrays.hpp"

namespace SPACEARM_NAMESPACE {

// Takes a setting out of the dictionary, so that what is left is unknown.
template <class V> void field(nb::dict& d, const char* key, V& value) {
    if (!d.contains(key)) return;
    const nb::object given = d[key];
    if (!nb::try_cast(given, value)) throw nb::type_error(key);
    nb::del(d[key]);
}

// Rows of q into packs, a pack of rows at a time; f(first_row, rows_in_pack, packs). Rows beyond the last repeat it.
// Rows are turned into columns a block at a time, so that no pack is read back while its numbers are still being
// written.
template <class T, class F> void for_packs(const in2<T>& q, F&& f) {
    constexpr std::size_t W = lanes_of<T>, block = 32 * W;
    const std::size_t rows = q.shape(0), dims = q.shape(1);
    const std::ptrdiff_t row = q.stride(0), column = q.stride(1);
    std::vector<T> columns(dims * block);
    std::vector<pack<T>> packs(dims);
    for (std::size_t begin = 0; begin < rows; begin += block) {
        const std::size_t filled = std::min(block, rows - begin), padded = (filled + W - 1) / W * W;
        for (std::size_t i = 0; i < padded; ++i) {
            const T* from = q.data() + static_cast<std::ptrdiff_t>(begin + std::min(i, filled - 1)) * row;
            for (std::size_t d = 0; d < dims; ++d)
                columns[d * block + i] = from[static_cast<std::ptrdiff_t>(d) * column];
        }
        for (std::size_t i = 0; i < padded; i += W) {
            for (std::size_t d = 0; d < dims; ++d) packs[d] = pack<T>::load(&columns[d * block + i]);
            f(begin + i, std::min(W, filled - i), packs.data());
        }
    }
}

template <class T> void store_lanes(const pack<T>& p, T* to, std::size_t filled, std::size_t stride = 1) {
    T lane[lanes_of<T>];
    p.store(lane);
    for (std::size_t i = 0; i < filled; ++i) to[i * stride] = lane[i];
}

template <class T>
model<T> make_model(in1<std::int32_t> parent, in1<std::int32_t> kind, in1<std::int32_t> dof, in1<double> multiplier,
                    in1<double> offset, nb::ndarray<const double, nb::ndim<3>, nb::c_contig> rotation,
                    in2c<double> translation, int dofs, in1<std::int32_t> point_joint, in2c<double> point_local,
                    in1<std::int32_t> capsule_a, in1<std::int32_t> capsule_b, in1<double> capsule_radius,
                    in2c<double> sphere_center, in1<double> sphere_radius) {
    model<T> m;
    const std::size_t n = parent.shape(0), points = point_joint.shape(0), links = capsule_a.shape(0),
                      balls = sphere_radius.shape(0);
    require(kind.shape(0) == n && dof.shape(0) == n && multiplier.shape(0) == n && offset.shape(0) == n
                && rotation.shape(0) == n && rotation.shape(1) == 3 && rotation.shape(2) == 3
                && translation.shape(0) == n && translation.shape(1) == 3,
            "the joints' arrays do not fit each other");
    require(point_local.shape(0) == points && point_local.shape(1) == 3, "the points' arrays do not fit each other");
    require(capsule_b.shape(0) == links && capsule_radius.shape(0) == links,
            "the capsules' arrays do not fit each other");
    require(sphere_center.shape(0) == balls && sphere_center.shape(1) == 3,
            "the spheres' arrays do not fit each other");
    require(dofs >= 1 && dofs <= most_dofs, "no degree of freedom, or too many");
    require(all_within(multiplier, widest) && all_within(offset, widest) && all_within(rotation, widest)
                && all_within(translation, widest) && all_within(point_local, widest)
                && all_within(capsule_radius, widest) && all_within(sphere_center, widest)
                && all_within(sphere_radius, widest),
            "a number that is none, or too large");
    m.robot.dofs = dofs;
    for (std::size_t j = 0; j < n; ++j) {
        require(parent(j) < static_cast<int>(j) && parent(j) >= -1, "parents come before children");
        require(dof(j) >= 0 && dof(j) < dofs, "a joint's degree of freedom is out of range");
        m.robot.joints.push_back(make_joint<T>(parent(j), kind(j) == 0 ? joint_kind::revolute : joint_kind::prismatic,
                                               dof(j), multiplier(j), offset(j), rotation.data() + 9 * j,
                                               translation.data() + 3 * j));
    }
    std::vector<unsigned> used(n, 0);
    for (std::size_t i = 0; i < point_joint.shape(0); ++i) {
        const int joint = point_joint(i);
        require(joint >= -1 && joint < static_cast<int>(n), "a point's joint is out of range");
        point<T> p{joint, {}};
        for (int k = 0; k < 3; ++k) {
            p.local[k] = static_cast<T>(point_local(i, k));
            if (joint >= 0 && p.local[k] != T(0)) used[joint] |= 1u << k;
        }
        m.points.push_back(p);
    }
    mark_needed(m.robot, used);
    for (std::size_t i = 0; i < capsule_a.shape(0); ++i) {
        const int a = capsule_a(i), b = capsule_b(i), points = static_cast<int>(m.points.size());
        require(a >= 0 && a < points && b >= 0 && b < points, "a capsule's point is out of range");
        // Both ends move with one body, though possibly named by two joints whose origins coincide: measure at q = 0.
        m.capsules.push_back({a, b, static_cast<T>(capsule_radius(i)), T(0)});
    }
    workspace<T> w(m);
    std::vector<pack<T>> zero(std::max(dofs, 1), pack<T>(T(0)));
    place(m, zero.data(), w);
    for (std::size_t i = 0; i < m.capsules.size(); ++i) {
        T squared[lanes_of<T>];
        dot(w.axis[i], w.axis[i]).store(squared);
        m.capsules[i].inverse_squared_length = squared[0] > T(0) ? T(1) / squared[0] : T(0);
    }
    for (std::size_t i = 0; i < sphere_center.shape(0); ++i) {
        sphere<T> s{{}, static_cast<T>(sphere_radius(i))};
        for (int k = 0; k < 3; ++k) s.center[k] = static_cast<T>(sphere_center(i, k));
        m.spheres.push_back(s);
    }
    return m;
}

template <class T> void require_columns(const model<T>& m, const in2<T>& q) {
    require(static_cast<int>(q.shape(1)) == m.robot.dofs, "wrong number of dimensions");
}

template <class T> nb::object joint_frames(const model<T>& m, in2<T> q) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0), n = m.robot.joints.size();
    tree<T> whole = m.robot;
    for (auto& joint : whole.joints) joint.needed = 7;
    std::vector<T> out(rows * n * 16, T(0));
    std::vector<frame<T>> frames(n);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            forward_kinematics(whole, packs, frames.data());
            for (std::size_t j = 0; j < n; ++j) {
                T* to = &out[(first * n + j) * 16];
                const vec3<T>* columns[4] = {&frames[j].column[0], &frames[j].column[1], &frames[j].column[2],
                                             &frames[j].origin};
                for (int k = 0; k < 4; ++k) {
                    store_lanes(columns[k]->x, to + k, filled, n * 16);
                    store_lanes(columns[k]->y, to + 4 + k, filled, n * 16);
                    store_lanes(columns[k]->z, to + 8 + k, filled, n * 16);
                }
                for (std::size_t i = 0; i < filled; ++i) to[i * n * 16 + 15] = T(1);
            }
        });
    }
    return array_of(std::move(out), {rows, n, 4, 4});
}

template <class T> nb::object point_positions(const model<T>& m, in2<T> q) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0), n = m.points.size();
    std::vector<T> out(rows * n * 3);
    workspace<T> w(m);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            place(m, packs, w);
            for (std::size_t i = 0; i < n; ++i) {
                T* to = &out[(first * n + i) * 3];
                store_lanes(w.points[i].x, to, filled, n * 3);
                store_lanes(w.points[i].y, to + 1, filled, n * 3);
                store_lanes(w.points[i].z, to + 2, filled, n * 3);
            }
        });
    }
    return array_of(std::move(out), {rows, n, 3});
}

template <class T> nb::object clearances(const model<T>& m, in2<T> q) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0), links = m.capsules.size(), balls = m.spheres.size();
    std::vector<T> out(rows * links * balls);
    workspace<T> w(m);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            place(m, packs, w);
            for (std::size_t i = 0; i < links; ++i) {
                for (std::size_t k = 0; k < balls; ++k) {
                    const point_capsule<T>& link = m.capsules[i];
                    const pack<T> d = capsule_sphere_clearance(w.points[link.a], w.points[link.b], link, m.spheres[k]);
                    store_lanes(d, &out[(first * links + i) * balls + k], filled, links * balls);
                }
            }
        });
    }
    return array_of(std::move(out), {rows, links, balls});
}

// ---- envelope and obstacles -----------------------------------------------------------------------------------------
template <class T> void take3(const double* from, T* to) {
    for (int k = 0; k < 3; ++k) to[k] = static_cast<T>(from[k]);
}

// One obstacle from a row of numbers: ball c r; rod a b r; box c axes(3 x 3) half(3); drum c axis half_length r; wall n
// offset.
template <class T> void add_obstacle(model<T>& m, int kind, const double* v) {
    obstacle_set<T>& all = m.obstacles;
    std::array<T, 3> center{T(v[0]), T(v[1]), T(v[2])};
    switch (static_cast<shape>(kind)) {
        case shape::sphere: {
            sphere<T> o{};
            take3(v, o.center);
            o.radius = static_cast<T>(v[3]);
            all.spheres.push_back(o);
            break;
        }
        case shape::capsule: {
            capsule_obstacle<T> o{};
            double squared = 0;
            for (int k = 0; k < 3; ++k) {
                o.a[k] = static_cast<T>(v[k]);
                o.ab[k] = static_cast<T>(v[3 + k] - v[k]);
                squared += (v[3 + k] - v[k]) * (v[3 + k] - v[k]);
                center[k] = static_cast<T>((v[k] + v[3 + k]) / 2);
            }
            o.inverse_squared_length = squared > 0 ? static_cast<T>(1 / squared) : T(0);
            o.radius = static_cast<T>(v[6]);
            all.capsules.push_back(o);
            break;
        }
        case shape::box: {
            box_obstacle<T> o{};
            take3(v, o.center);
            for (int k = 0; k < 3; ++k) take3(v + 3 + 3 * k, o.axis[k]);
            take3(v + 12, o.half);
            all.boxes.push_back(o);
            break;
        }
        case shape::cylinder: {
            cylinder_obstacle<T> o{};
            take3(v, o.center);
            take3(v + 3, o.axis);
            o.half_length = static_cast<T>(v[6]);
            o.radius = static_cast<T>(v[7]);
            all.cylinders.push_back(o);
            break;
        }
        case shape::half_space: {
            half_space_obstacle<T> o{};
            take3(v, o.normal);
            o.offset = static_cast<T>(v[3]);
            for (int k = 0; k < 3; ++k) center[k] = static_cast<T>(v[3] * v[k]);
            all.half_spaces.push_back(o);
            break;
        }
        default: require(false, "an unknown shape");
    }
    m.obstacle_order.push_back({static_cast<shape>(kind), static_cast<int>(all.count(static_cast<shape>(kind))) - 1});
    m.obstacle_centers.push_back(center);
}

// A copy of the model with its capsules in clusters, link by link, the pairs of links that must keep clear, and
// obstacles of every shape. Capsules of one link stand together; `index` is their place in the robot's own list.
template <class T>
model<T> surrounded(const model<T>& plain, in1<std::int32_t> index, in1<std::int32_t> joint, in1<std::int32_t> link,
                    in2c<double> a, in2c<double> b, in1<double> radius,
                    nb::ndarray<const std::int32_t, nb::ndim<2>, nb::c_contig> pairs, in1<std::int32_t> kinds,
                    in2c<double> numbers) {
    model<T> m = plain;
    m.envelope = {};
    m.obstacles = {};
    m.obstacle_order.clear();
    m.obstacle_centers.clear();
    const std::size_t capsules = joint.shape(0);
    const int joints = static_cast<int>(m.robot.joints.size());
    require(index.shape(0) == capsules && link.shape(0) == capsules && a.shape(0) == capsules && b.shape(0) == capsules
                && radius.shape(0) == capsules,
            "the capsules' arrays do not fit");
    require(capsules == 0 || (a.shape(1) == 3 && b.shape(1) == 3), "the capsules' arrays do not fit");
    require(kinds.shape(0) == 0 || (numbers.shape(0) == kinds.shape(0) && numbers.shape(1) == 15),
            "the obstacles' arrays do not fit");
    require(pairs.shape(0) == 0 || pairs.shape(1) == 2, "the pairs' array does not fit");
    require(all_within(a, widest) && all_within(b, widest) && all_within(radius, widest) && all_within(numbers, widest),
            "a number that is none, or too large");
    std::vector<char> taken(capsules, 0);
    std::vector<std::vector<int>> clusters_of;  // by link
    for (std::size_t first = 0; first < capsules;) {
        std::size_t last = first;
        for (; last < capsules && link(last) == link(first) && joint(last) == joint(first); ++last) {
            require(joint(last) >= -1 && joint(last) < joints, "a capsule's joint is out of range");
            link_capsule<T> c = make_link_capsule<T>(a.data() + 3 * last, b.data() + 3 * last, radius(last));
            require(index(last) >= 0 && index(last) < static_cast<int>(capsules) && !taken[index(last)],
                    "a capsule's index is out of range or taken");
            taken[index(last)] = 1;
            c.index = index(last);
            m.envelope.capsules.push_back(c);
        }
        require(link(first) >= 0 && static_cast<std::size_t>(link(first)) < capsules, "a link is out of range");
        if (static_cast<std::size_t>(link(first)) >= clusters_of.size()) clusters_of.resize(link(first) + 1);
        make_clusters(m.envelope, joint(first), static_cast<int>(first), static_cast<int>(last),
                      clusters_of[link(first)]);
        first = last;
    }
    for (std::size_t i = 0; i < pairs.shape(0); ++i) {
        const int one = pairs(i, 0), two = pairs(i, 1), known = static_cast<int>(clusters_of.size());
        require(one >= 0 && two >= 0 && one < known && two < known && one != two, "a pair's link is out of range");
        for (int x : clusters_of[one]) {
            for (int y : clusters_of[two]) m.envelope.pairs.push_back({x, y});
        }
    }
    for (std::size_t i = 0; i < kinds.shape(0); ++i) add_obstacle(m, kinds(i), numbers.data() + 15 * i);
    m.obstacles.build_tree();
    // The columns that the envelope needs, beside those of the points.
    std::vector<unsigned> used(joints, 0);
    const auto use = [&](int j, const T* local) {
        for (int k = 0; j >= 0 && k < 3; ++k) used[j] |= local[k] != T(0) ? 1u << k : 0u;
    };
    for (const point<T>& p : m.points) use(p.joint, p.local);
    for (const cluster<T>& c : m.envelope.clusters) {
        use(c.joint, c.center);
        for (int i = c.first; i < c.last; ++i) {
            const link_capsule<T>& capsule = m.envelope.capsules[i];
            for (const T* local : {capsule.a, capsule.ab, capsule.middle}) use(c.joint, local);
        }
    }
    mark_needed(m.robot, used);
    return m;
}

inline constexpr double most_of_masses = 1e18;  // [kg], [kg m^2]
// A copy of the model whose capsules (by their place in the robot's own list) may come nearer to obstacles (by theirs
// in the scene), or to other capsules where the obstacle is -1, than the margin: no more than `most` is asked for
// between them.
template <class T>
model<T> eased(const model<T>& plain, in1<std::int32_t> capsule, in1<std::int32_t> obstacle, in1<std::int32_t> other,
               in1<double> most) {
    require(obstacle.shape(0) == capsule.shape(0) && other.shape(0) == capsule.shape(0)
                && most.shape(0) == capsule.shape(0),
            "the eased pairs' arrays do not fit");
    model<T> m = plain;
    link_envelope<T>& b = m.envelope;
    const int capsules = static_cast<int>(b.capsules.size()), obstacles = static_cast<int>(m.obstacle_order.size());
    std::vector<int> cluster_of(capsules, 0);
    for (std::size_t c = 0; c < b.clusters.size(); ++c) {
        for (int i = b.clusters[c].first; i < b.clusters[c].last; ++i)
            cluster_of[b.capsules[i].index] = static_cast<int>(c);
    }
    std::map<std::pair<shape, int>, int> node_of;
    for (std::size_t k = 0; k < m.obstacles.tree.size(); ++k)
        node_of[{m.obstacles.tree[k].kind, m.obstacles.tree[k].index}] = static_cast<int>(k);
    b.eased.clear();
    for (std::size_t i = 0; i < capsule.shape(0); ++i) {
        require(capsule(i) >= 0 && capsule(i) < capsules && obstacle(i) < obstacles && other(i) < capsules
                    && (obstacle(i) >= 0 || other(i) >= 0),
                "an eased pair is out of range");
        const int one = cluster_of[capsule(i)];
        if (obstacle(i) >= 0) {
            b.eased.push_back({one, node_of.at(m.obstacle_order[obstacle(i)]), static_cast<T>(most(i))});
            continue;
        }
        const int two = cluster_of[other(i)];
        for (std::size_t p = 0; p < b.pairs.size(); ++p) {
            const auto& [x, y] = b.pairs[p];
            if ((x == one && y == two) || (x == two && y == one))
                b.eased.push_back({-1, static_cast<int>(p), static_cast<T>(most(i))});
        }
    }
    std::sort(b.eased.begin(), b.eased.end(),
              [](const pair_margin<T>& x, const pair_margin<T>& y) {  // of one pair the least first
                  return x.cluster == y.cluster && x.other == y.other ? x.most < y.most : x.before(y.cluster, y.other);
              });
    return m;
}

// A copy of the model with its masses, for a base that floats: a row for the base, then one a joint.
template <class T> model<T> weighed(const model<T>& plain, in1<double> mass, in2c<double> com, in2c<double> inertia) {
    const std::size_t n = plain.robot.joints.size();
    require(mass.shape(0) == n + 1 && com.shape(0) == n + 1 && com.shape(1) == 3 && inertia.shape(0) == n + 1
                && inertia.shape(1) == 6,
            "the masses' arrays do not fit");
    model<T> m = plain;
    double total = 0;
    for (std::size_t i = 0; i <= n; ++i) total += mass(i);
    require(static_cast<T>(total) > T(0) && all_within(mass, most_of_masses) && all_within(com, widest)
                && all_within(inertia, most_of_masses),
            "no mass, or a number that is none or too large");
    m.masses = {};
    m.masses.total = static_cast<T>(total);
    const double *c = com.data(), *I = inertia.data();
    take3(c, m.masses.about);
    for (int k = 0; k < 6; ++k) m.masses.second[k] = static_cast<T>(I[k]);
    m.shape_columns.clear();
    for (std::size_t j = 0; j < n; ++j) {
        m.masses.joints.push_back(make_mass<T>(mass(j + 1), c + 3 * (j + 1), I + 6 * (j + 1)));
        m.shape_columns.push_back(m.robot.joints[j].needed);
        m.robot.joints[j].needed = 7;
    }
    return m;
}

// At configurations and rates, with the base at rest: centre of mass, angular momentum about it, inertia about it (xx,
// yy, zz, xy, xz, yz), the rate that the base turns at, and the centre's velocity: (rows, 18).
template <class T> nb::object momentum_terms(const model<T>& m, in2<T> q, in2c<T> dq) {
    require_columns(m, q);
    require(dq.shape(0) == q.shape(0) && dq.shape(1) == q.shape(1) && !m.masses.joints.empty(),
            "rates do not fit, or no masses");
    const std::size_t rows = q.shape(0), n = dq.shape(1);
    std::vector<T> out(rows * 18), column(lanes_of<T>);
    std::vector<frame<T>> frames(m.robot.joints.size());
    std::vector<spin_and_velocity<T>> rates(frames.size());
    std::vector<pack<T>> speed(n);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            for (std::size_t d = 0; d < n; ++d) {
                for (std::size_t i = 0; i < lanes_of<T>; ++i) column[i] = dq(first + std::min(i, filled - 1), d);
                speed[d] = pack<T>::load(column.data());
            }
            forward_kinematics(m.robot, packs, frames.data());
            const momentum_at<T> at = momentum_of(m.robot, m.masses, speed.data(), frames.data(), rates.data());
            const vec3<T> w = solved(at.inertia, at.arm);
            const symmetric3<T>& H = at.inertia;
            const pack<T> columns[18] = {at.com.x, at.com.y, at.com.z, at.arm.x,      at.arm.y,      at.arm.z,
                                         H.xx,     H.yy,     H.zz,     H.xy,          H.xz,          H.yz,
                                         -w.x,     -w.y,     -w.z,     at.velocity.x, at.velocity.y, at.velocity.z};
            for (int k = 0; k < 18; ++k) store_lanes(columns[k], &out[first * 18 + k], filled, 18);
        });
    }
    return array_of(std::move(out), {rows, 18});
}

// Places every capsule for a pack of configurations.
template <class T> struct placed_capsules {
    const model<T>& m;
    workspace<T> work;
    envelope_memory<T> body;
    explicit placed_capsules(const model<T>& given) : m(given), work(given), body(given.envelope) {}
    void at(const pack<T>* q) {
        forward_kinematics(m.robot, q, work.frames.data());
        place(m.envelope, work.frames.data(), body);
        for (std::size_t i = 0; i < m.envelope.clusters.size(); ++i)
            place_capsules(m.envelope, work.frames.data(), static_cast<int>(i), body);
    }
};

// Of every capsule and every obstacle, in the order they were given: (rows, capsules, obstacles).
template <class T> nb::object obstacle_clearances(const model<T>& m, in2<T> q) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0), links = m.envelope.capsules.size(), obstacles = m.obstacle_order.size();
    std::vector<T> out(rows * links * obstacles);
    placed_capsules<T> placed(m);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            placed.at(packs);
            for (std::size_t i = 0; i < links; ++i) {
                const link_capsule<T>& c = m.envelope.capsules[i];
                for (std::size_t k = 0; k < obstacles; ++k) {
                    const auto [kind, index] = m.obstacle_order[k];
                    const pack<T> d = m.obstacles.visit(kind, index, [&](const auto& o) {
                        return c.inverse_squared_length == T(0)
                                   ? distance_to(o, placed.body.a[i])
                                   : axis_distance(o, placed.body.a[i], placed.body.ab[i], c.inverse_squared_length);
                    });
                    store_lanes(d - c.radius, &out[(first * links + c.index) * obstacles + k], filled,
                                links * obstacles);
                }
            }
        });
    }
    return array_of(std::move(out), {rows, links, obstacles});
}

// Of pairs of capsules, by their indices as given: (rows, pairs).
template <class T>
nb::object pair_clearances(const model<T>& m, in2<T> q,
                           nb::ndarray<const std::int32_t, nb::ndim<2>, nb::c_contig> pairs) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0), count = pairs.shape(0), capsules = m.envelope.capsules.size();
    require(count == 0 || pairs.shape(1) == 2, "the pairs' array does not fit");
    std::vector<T> out(rows * count);
    std::vector<std::size_t> at(capsules);
    for (std::size_t i = 0; i < capsules; ++i) at[m.envelope.capsules[i].index] = i;
    for (std::size_t i = 0; i < count; ++i) {
        for (int k = 0; k < 2; ++k)
            require(pairs(i, k) >= 0 && pairs(i, k) < static_cast<int>(capsules), "a pair's capsule is out of range");
    }
    placed_capsules<T> placed(m);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            placed.at(packs);
            for (std::size_t i = 0; i < count; ++i) {
                const std::size_t one = at[pairs(i, 0)], two = at[pairs(i, 1)];
                const pack<T> d =
                    sqrt(squared_distance(m.envelope, placed.body, static_cast<int>(one), static_cast<int>(two)));
                store_lanes(d - (m.envelope.capsules[one].radius + m.envelope.capsules[two].radius),
                            &out[first * count + i], filled, count);
            }
        });
    }
    return array_of(std::move(out), {rows, count});
}

// What the search sees: the shortfall of clearance, summed over all pairs, (rows,).
template <class T> nb::object shortfalls(const model<T>& m, in2<T> q, double margin, bool stop_early) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0);
    std::vector<T> out(rows);
    workspace<T> work(m);
    envelope_memory<T> body(m.envelope);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            forward_kinematics(m.robot, packs, work.frames.data());
            store_lanes(
                shortfall(m.envelope, work.frames.data(), m.obstacles, static_cast<T>(margin), body, stop_early),
                &out[first], filled);
        });
    }
    return array_of(std::move(out), {rows});
}

}  // namespace SPACEARM_NAMESPACE
