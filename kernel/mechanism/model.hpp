// What is evaluated: a robot's tree, the points it carries, the capsules between them, and the obstacles around it.
#pragma once

#include <array>

#include "mechanism/envelope.hpp"
#include "mechanism/momentum.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> struct point {
    int joint;   // the joint that carries it, -1 for the base
    T local[3];  // in that joint's frame
};

// A capsule's axis runs between two of the model's points, both on the same rigid body, so its length is constant.
template <class T> struct point_capsule {
    int a, b;  // point indices
    T radius;
    T inverse_squared_length;  // 0 for a sphere (a == b)
};

template <class T> struct model {
    tree<T> robot;
    std::vector<point<T>> points;
    std::vector<point_capsule<T>> capsules;
    std::vector<sphere<T>> spheres;                     // the paper's obstacles
    link_envelope<T> envelope;                          // the same capsules, arranged
    obstacle_set<T> obstacles;                          // all of them, arranged
    std::vector<std::pair<shape, int>> obstacle_order;  // as they were given
    std::vector<std::array<T, 3>> obstacle_centers;     // likewise
    std::vector<int> cluster_of, node_of;               // of each body and each obstacle, as they were given
    mass_model<T> masses;                               // where the base floats
    std::vector<unsigned> shape_columns;  // likewise: the columns that points and envelope use, a mask a joint
};

// Memory for one evaluation, made once a thread.
template <class T> struct workspace {
    std::vector<frame<T>> frames;
    std::vector<vec3<T>> points;
    std::vector<vec3<T>> to_center;  // from each point to the obstacle at hand
    std::vector<vec3<T>> axis;       // of each capsule
    explicit workspace(const model<T>& m)
        : frames(m.robot.joints.size()), points(m.points.size()), to_center(m.points.size()), axis(m.capsules.size()) {}
};

// The points, with the frames in place; base: where the base is, or nullptr at the beginning.
template <class T> SPACEARM_INLINE void place_points(const model<T>& m, const frame<T>* base, workspace<T>& w) {
    for (std::size_t i = 0; i < m.points.size(); ++i) {
        const point<T>& p = m.points[i];
        if (p.joint >= 0) w.points[i] = carry(w.frames[p.joint], p.local);
        else w.points[i] = base ? carry(*base, p.local) : constant(p.local);
    }
}

// Frames, points and capsule axes for one pack of configurations.
template <class T> SPACEARM_INLINE void place(const model<T>& m, const pack<T>* q, workspace<T>& w) {
    forward_kinematics(m.robot, q, w.frames.data());
    place_points<T>(m, nullptr, w);
    for (std::size_t i = 0; i < m.capsules.size(); ++i)
        w.axis[i] = w.points[m.capsules[i].b] - w.points[m.capsules[i].a];
}

// Clearance [m] of capsule and sphere, negative when they penetrate.
template <class T>
SPACEARM_INLINE pack<T> capsule_sphere_clearance(const vec3<T>& a, const vec3<T>& b, const point_capsule<T>& link,
                                                 const sphere<T>& obstacle) {
    const vec3<T> c{pack<T>(obstacle.center[0]), pack<T>(obstacle.center[1]), pack<T>(obstacle.center[2])};
    const pack<T> d2 = squared_distance_to_axis(c - a, b - a, pack<T>(link.inverse_squared_length));
    return sqrt(d2) - (link.radius + obstacle.radius);
}

// Sum over capsules and obstacles of how far the clearance falls short of the margin [m]; 0 when none does. Pairs that
// are far apart in every lane, nearly all, cost no square root.
template <class T>
SPACEARM_INLINE pack<T> shortfall_to(const model<T>& m, const sphere<T>& obstacle, T margin, const workspace<T>& w) {
    pack<T> sum(T(0));
    for (std::size_t i = 0; i < m.capsules.size(); ++i) {
        const point_capsule<T>& link = m.capsules[i];
        const T reach = link.radius + obstacle.radius + margin;
        const pack<T> d2 =
            squared_distance_to_axis(w.to_center[link.a], w.axis[i], pack<T>(link.inverse_squared_length));
        if (!all(pack<T>(reach * reach) <= d2)) sum += above_zero(reach - sqrt(d2));
    }
    return sum;
}

template <class T> SPACEARM_INLINE void point_to(const model<T>& m, const sphere<T>& obstacle, workspace<T>& w) {
    const vec3<T> c = constant(obstacle.center);
    for (std::size_t i = 0; i < m.points.size(); ++i) w.to_center[i] = c - w.points[i];
}

}  // namespace SPACEARM_NAMESPACE
