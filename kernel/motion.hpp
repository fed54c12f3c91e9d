// The objective of the planner's swarm: one particle is the interior control points of a spline motion, sampled.
#pragma once

#include "model.hpp"

namespace SPACEARM_NAMESPACE {

// Control points: the start three times, K interior ones (the decision variables, row by row), the goal three times. The
// basis' values at the samples come from outside, with those of the repeated ends summed.
template <class T> struct motion_objective {
    model<T> scene;
    std::vector<T> start, goal;      // configurations (n,)
    std::vector<T> basis;            // (samples, K + 2): start, interior, goal
    int samples = 0, interior = 0;
    T margin = 0;                    // [m] clearance asked for at the samples
    T length_weight = 1;

    int dims() const { return interior * scene.robot.dofs; }

    struct memory {
        workspace<T> body;
        std::vector<pack<T>> q, before;
    };
    memory make_workspace() const {
        const std::size_t n = scene.robot.dofs;
        return {workspace<T>(scene), std::vector<pack<T>>(n), std::vector<pack<T>>(n)};
    }

    // fitness: joint path length, the sum over the samples of the Euclidean step [rad or m]; violation: the mean over the
    // samples of the clearance's shortfall [m].
    SPACEARM_INLINE void operator()(const pack<T>* x, memory& w, pack<T>& fitness, pack<T>& violation) const {
        const int n = scene.robot.dofs;
        pack<T> length(T(0)), broken(T(0));
        for (int s = 0; s < samples; ++s) {
            const T* b = &basis[static_cast<std::size_t>(s) * (interior + 2)];
            pack<T> squared(T(0));
            for (int d = 0; d < n; ++d) {
                pack<T> value(b[0] * start[d] + b[interior + 1] * goal[d]);
                for (int k = 0; k < interior; ++k) value += x[k * n + d] * b[k + 1];
                w.q[d] = value;
                const pack<T> step = value - w.before[d];
                squared += step * step;
                w.before[d] = value;
            }
            if (s > 0) length += sqrt(squared);
            place(scene, w.q.data(), w.body);
            for (const sphere<T>& ball : scene.spheres) {
                point_to(scene, ball, w.body);
                broken += shortfall_to(scene, ball, margin, w.body);
            }
        }
        fitness = length * length_weight;
        violation = broken / T(samples);
    }
};

}  // namespace SPACEARM_NAMESPACE
