// The paper's fitness (Zhang et al. 2022, eqs. (4)-(7)) and constraints (eqs. (1)-(3), (10), (11)) of one
// configuration.
#pragma once

#include "mechanism/model.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> struct paper_objective {
    model<T> scene;
    std::vector<int> centers;  // the points of eq. (5): distinct joint centres and the end effector, those that move
    T f1_at_rest = 0;          // what the centres on the base add to f1, always the same
    int tip = 0;               // the end effector's point
    T goal[3] = {};
    T weight[3] = {};        // omega_1, omega_2, omega_3
    bool must_reach = true;  // the goal as a constraint ("goal" mode), or only as the terms (6), (7) ("literal")
    T tolerance = 0;         // [m]

    int dims() const { return scene.robot.dofs; }
    workspace<T> make_workspace() const { return workspace<T>(scene); }

    // terms, when asked for: f1, f2, f3.
    SPACEARM_INLINE void operator()(const pack<T>* q, workspace<T>& w, pack<T>& fitness, pack<T>& violation,
                                    pack<T>* terms = nullptr) const {
        place(scene, q, w);
        pack<T> f1(f1_at_rest), broken(T(0));
        for (const sphere<T>& obstacle : scene.spheres) {
            point_to(scene, obstacle, w);
            for (int i : centers) f1 += sqrt(dot(w.to_center[i], w.to_center[i]));  // eq. (5)
            broken += shortfall_to(scene, obstacle, T(0), w);                       // eqs. (1)-(3), (10), (11)
        }
        const vec3<T> left = constant(goal) - w.points[tip];
        const pack<T> d2 = dot(left, left);
        const pack<T> f2 = sqrt(d2 + T(1));  // eq. (6), z joined
        const pack<T> f3 = sqrt(d2);         // eq. (7)
        if (must_reach) broken += above_zero(f3 - tolerance);
        fitness = f1 * weight[0] + f2 * weight[1] + f3 * weight[2];  // eq. (4)
        violation = broken;
        if (terms) {
            terms[0] = f1;
            terms[1] = f2;
            terms[2] = f3;
        }
    }
};

// Configurations that bring points of the robot to given places: the paper's constraints with a margin, the distance
// from home as fitness. One point asks for a position; two or three of one frame for an axis or a pose.
template <class T> struct reach_objective {
    struct target {
        int point;
        T position[3];
        T tolerance;  // [m]
    };
    struct memory {
        workspace<T> points;
        envelope_memory<T> body;
    };
    model<T> scene;
    std::vector<target> targets;
    T margin = 0;         // [m] clearance asked for
    std::vector<T> home;  // (n,)

    int dims() const { return scene.robot.dofs; }
    memory make_workspace() const { return {workspace<T>(scene), envelope_memory<T>(scene.envelope)}; }

    SPACEARM_INLINE void operator()(const pack<T>* q, memory& w, pack<T>& fitness, pack<T>& violation) const {
        place(scene, q, w.points);
        pack<T> squared(T(0));
        violation = shortfall<T>(scene.envelope, w.points.frames.data(), scene.obstacles, {margin}, w.body, false);
        for (const target& to : targets) {
            const vec3<T> left = constant(to.position) - w.points.points[to.point];
            violation += above_zero(sqrt(dot(left, left)) - to.tolerance);
        }
        for (int d = 0; d < dims(); ++d) {
            const pack<T> step = q[d] - home[d];
            squared += step * step;
        }
        fitness = sqrt(squared);
    }
};

}  // namespace SPACEARM_NAMESPACE
