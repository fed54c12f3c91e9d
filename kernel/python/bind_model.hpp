// Python's arrays and a model: where it is, and how far from what is around it.
#pragma once

#include "mechanism/levers.hpp"
#include "python/bind_world.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> void require_columns(const model<T>& m, const in2<T>& q) {
    require(static_cast<int>(q.shape(1)) == m.robot.dofs, "wrong number of dimensions");
}

template <class T> out_array<T, 4> joint_frames(const model<T>& m, in2<T> q) {
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
    return array_of<T, 4>(std::move(out), {rows, n, 4, 4});
}

template <class T> out_array<T, 3> point_positions(const model<T>& m, in2<T> q) {
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
    return array_of<T, 3>(std::move(out), {rows, n, 3});
}

template <class T> out_array<T, 3> clearances(const model<T>& m, in2<T> q) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0), links = m.capsules.size(), spheres = m.spheres.size();
    std::vector<T> out(rows * links * spheres);
    workspace<T> w(m);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            place(m, packs, w);
            for (std::size_t i = 0; i < links; ++i) {
                for (std::size_t k = 0; k < spheres; ++k) {
                    const point_capsule<T>& link = m.capsules[i];
                    const pack<T> d = capsule_sphere_clearance(w.points[link.a], w.points[link.b], link, m.spheres[k]);
                    store_lanes(d, &out[(first * links + i) * spheres + k], filled, links * spheres);
                }
            }
        });
    }
    return array_of<T, 3>(std::move(out), {rows, links, spheres});
}

// At configurations and rates, with the base at rest: centre of mass, angular momentum about it, inertia about it (xx,
// yy, zz, xy, xz, yz), the rate that the base turns at, and the centre's velocity: (rows, 18).
template <class T> out_array<T, 2> momentum_terms(const model<T>& m, in2<T> q, in2c<T> dq) {
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
    return array_of<T, 2>(std::move(out), {rows, 18});
}

// Places every body for a pack of configurations.
template <class T> struct placed_bodies {
    static constexpr T far = std::numeric_limits<T>::max() / 4;  // all distances below are exact
    const model<T>& m;
    workspace<T> work;
    envelope_memory<T> memory;
    explicit placed_bodies(const model<T>& given) : m(given), work(given), memory(given.envelope) {}
    void at(const pack<T>* q) {
        forward_kinematics(m.robot, q, work.frames.data());
        place(m.envelope, work.frames.data(), memory);
        for (std::size_t i = 0; i < m.envelope.clusters.size(); ++i)
            place_bodies(m.envelope, work.frames.data(), static_cast<int>(i), memory);
    }
    template <class Shape> pack<T> to_obstacle(int i, const Shape& o) const {
        const link_body<T>& body = m.envelope.bodies[i];
        if (!has_axis_distance<T, Shape> || body.solid >= 0) return body_clearance(m.envelope, memory, i, o, far, true);
        const pack<T> d = body.inverse_squared_length == T(0)
                              ? distance_to(o, memory.a[i])
                              : axis_distance(o, memory.a[i], memory.ab[i], body.inverse_squared_length);
        return d - (body.radius + rounding_of<T>(o));
    }
    pack<T> between(int i, int k) const {
        const bool capsules = m.envelope.bodies[i].solid < 0 && m.envelope.bodies[k].solid < 0;
        return capsules ? capsule_clearance(m.envelope, memory, i, k)
                        : body_clearance(m.envelope, memory, i, k, far, true);
    }
};

// Of every body and every obstacle, in the order they were given: (rows, bodies, obstacles).
template <class T> out_array<T, 3> obstacle_clearances(const model<T>& m, in2<T> q) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0), bodies = m.envelope.bodies.size(), obstacles = m.obstacle_order.size();
    std::vector<T> out(rows * bodies * obstacles);
    placed_bodies<T> placed(m);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            placed.at(packs);
            for (std::size_t i = 0; i < bodies; ++i) {
                const std::size_t row = first * bodies + m.envelope.bodies[i].index;
                for (std::size_t k = 0; k < obstacles; ++k) {
                    const auto [kind, index] = m.obstacle_order[k];
                    const pack<T> d = m.obstacles.visit(
                        kind, index, [&](const auto& o) { return placed.to_obstacle(static_cast<int>(i), o); });
                    store_lanes(d, &out[row * obstacles + k], filled, bodies * obstacles);
                }
            }
        });
    }
    return array_of<T, 3>(std::move(out), {rows, bodies, obstacles});
}

// Of pairs of bodies, by their indices as given: (rows, pairs).
template <class T> out_array<T, 2> pair_clearances(const model<T>& m, in2<T> q, in_pairs pairs) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0), count = pairs.shape(0), bodies = m.envelope.bodies.size();
    std::vector<T> out(rows * count);
    std::vector<int> at(bodies);
    for (std::size_t i = 0; i < bodies; ++i) at[m.envelope.bodies[i].index] = static_cast<int>(i);
    for (std::size_t i = 0; i < count; ++i) {
        for (int k = 0; k < 2; ++k)
            require(pairs(i, k) >= 0 && pairs(i, k) < static_cast<int>(bodies), "a pair's body is out of range");
    }
    placed_bodies<T> placed(m);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            placed.at(packs);
            for (std::size_t i = 0; i < count; ++i)
                store_lanes(placed.between(at[pairs(i, 0)], at[pairs(i, 1)]), &out[first * count + i], filled, count);
        });
    }
    return array_of<T, 2>(std::move(out), {rows, count});
}

// What the search sees: the shortfall of clearance, summed over all pairs, (rows,).
template <class T> out_array<T, 1> shortfalls(const model<T>& m, in2<T> q, double margin, bool stop_early) {
    require_columns(m, q);
    const std::size_t rows = q.shape(0);
    std::vector<T> out(rows);
    workspace<T> work(m);
    envelope_memory<T> memory(m.envelope);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            forward_kinematics(m.robot, packs, work.frames.data());
            store_lanes(
                shortfall<T>(m.envelope, work.frames.data(), m.obstacles, {static_cast<T>(margin)}, memory, stop_early),
                &out[first], filled);
        });
    }
    return array_of<T, 1>(std::move(out), {rows});
}

// What the trees see: which configurations keep the margin, (rows,).
template <class T> out_array<bool, 1> free_rows(const model<T>& m, in2<T> q, double margin) {
    require_columns(m, q);
    std::vector<char> out(q.shape(0));
    workspace<T> work(m);
    envelope_memory<T> memory(m.envelope);
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            forward_kinematics(m.robot, packs, work.frames.data());
            free_lanes<T> lanes;
            compare_all<T>(m.envelope, work.frames.data(), m.obstacles, {static_cast<T>(margin)}, memory, lanes);
            for (std::size_t i = 0; i < filled; ++i) out[first + i] = lanes.is_free(static_cast<int>(i));
        });
    }
    return truths_of(out);
}
template <class T> out_array<T, 1> levers_of(const model<T>& m, in1<double> most) {
    require(static_cast<int>(most.shape(0)) == m.robot.dofs, "wrong number of dimensions");
    const std::vector<T> values(most.data(), most.data() + most.shape(0));
    return row_of(levers(m, values));
}

template <class T> void bind_model(nb::module_& m, const char* name) {
    nb::class_<model<T>>(m, name, "A robot among obstacles.")
        .def(
            "__init__", [](model<T>* self, const world& given) { new (self) model<T>(build<T>(given)); }, "world"_a)
        .def("joint_frames", &joint_frames<T>, "q"_a, "Frames of the joints (rows, joints, 4, 4).")
        .def("points", &point_positions<T>, "q"_a, "Positions of the points (rows, points, 3) [m].")
        .def("clearances", &clearances<T>, "q"_a, "Of point capsules and spheres (rows, capsules, spheres) [m].")
        .def("obstacle_clearances", &obstacle_clearances<T>, "q"_a,
             "Of the envelope's bodies and the obstacles (rows, bodies, obstacles) [m]; negative inside, by the depth: "
             "of a "
             "capsule and a box or a cylinder that of the deepest point of its axis.")
        .def("pair_clearances", &pair_clearances<T>, "q"_a, "pairs"_a,
             "Of pairs of bodies (rows, pairs) [m], as `obstacle_clearances`.")
        .def("shortfalls", &shortfalls<T>, "q"_a, "margin"_a, "stop_early"_a,
             "How far the clearance falls short of the margin, summed over pairs (rows,) [m].")
        .def("free", &free_rows<T>, "q"_a, "margin"_a, nb::rv_policy::move, "Whether all pairs keep it (rows,).")
        .def("levers", &levers_of<T>, "most"_a,
             "How far at most a unit of each joint moves any point of the bodies (n,); `most`: the joints' greatest "
             "values without their signs (n,).")
        .def(
            "momentum_terms", &momentum_terms<T>, "q"_a, "dq"_a,
            "With the base at rest: centre of mass, angular momentum, inertia (xx, yy, zz, xy, xz, yz), rate of a free "
            "base, velocity of the centre (rows, 18).");
}

}  // namespace SPACEARM_NAMESPACE
