// What is asked of a motion: where it begins and may end, what it must keep, and what makes it better.
#pragma once

#include "mechanism/model.hpp"
#include "motion/spline.hpp"
#include "motion/terminal.hpp"

namespace SPACEARM_NAMESPACE {

// [rad or m] No control point is further from 0, and no bound, start or goal may be.
inline constexpr double furthest = 1e6;

// A motion's control points: K rows of n between start and goal.
template <class T> struct motion {
    int interior = 0;
    int goal = 0;             // which of the problem's goals
    std::vector<T> points;    // (K, n)
    std::vector<T> end = {};  // (n,) where it ends, if that is not the goal's configuration
};

template <class T> struct motion_weights {
    T length = 1;              // joint path length, integral of |q'| [rad or m]
    T duration = 0;            // the fastest uniform time within the limits, by samples [s]
    T tip = 0;                 // path length of the end effector [m]
    T clearance = 0;           // mean of what the clearance lacks to the comfortable distance, summed over pairs [m]
    T smoothness = 0;          // mean of |q'''|^2 [rad^2 or m^2]
    T paper[3] = {0, 0, 0};    // the paper's f1, f2, f3, means over the samples
    T base[4] = {0, 0, 0, 0};  // of a floating base: its turn at the end, at its greatest [rad], its fastest rate
                               // [rad/s], and the arm's greatest angular momentum [N m s]
    bool carried() const { return tip > 0 || clearance > 0 || paper[0] > 0 || paper[1] > 0 || paper[2] > 0; }
    bool of_base() const { return base[0] > 0 || base[1] > 0 || base[2] > 0 || base[3] > 0; }
    bool only_length() const { return !(duration > 0) && !(smoothness > 0) && !carried() && !of_base(); }
};

// The system's momentum about its centre of mass, in the frame of the base at the beginning, over a motion of given
// duration.
template <class T> struct constant_momentum {
    bool any = false;
    T angular[3] = {};  // [N m s]
    T drift[3] = {};    // of the centre of mass over the whole motion [m]
    T duration = 0;     // [s]
};

enum class base_kind : std::uint8_t { fixed, floating };

// What is asked of the base, and of the motion for its sake. Only the duration may be asked for on a fixed base.
template <class T> struct base_demands {
    base_kind kind = base_kind::fixed;
    terminal_constraints ends;
    bool free_end = false;  // the last configuration is the search's to choose
    constant_momentum<T> momentum;
    T most_turned = 0, most_rate = 0, most_arm = 0;  // limits [rad], [rad/s], [N m s]; 0: none. The last two slow down.
    // Whether more is asked than clearance: then a free path says little of what a motion must be.
    bool constrained() const { return ends.any() || most_turned > 0; }
};

template <class T> struct motion_problem {
    model<T> scene;
    std::vector<T> start, goals;            // (n,), (g, n)
    std::vector<T> lower, upper;            // (n,) where control points may be
    std::vector<T> velocity, acceleration;  // (n,) limits, for the duration
    std::vector<T> jerk;                    // (n,) or empty
    T margin = 0;                           // [m] clearance asked for at the instants
    T comfort = 0;                          // [m] for the clearance term
    int tip = 0;                            // the end effector's point
    std::vector<int> centers;               // points of the paper's f1
    motion_weights<T> weight;
    base_demands<T> base;

    int dofs() const { return scene.robot.dofs; }
    int goal_count() const { return static_cast<int>(goals.size()) / dofs(); }
    const T* goal(int i) const { return &goals[static_cast<std::size_t>(i) * dofs()]; }
    const T* end(const motion<T>& m) const { return m.end.empty() ? goal(m.goal) : m.end.data(); }
    // One coordinate of the spline, or of a derivative, at a pack of instants: `basis` is a spline table's.
    SPACEARM_INLINE pack<T> coordinate(const motion<T>& m, const T* basis, int d) const {
        const int K = m.interior, n = dofs(), W = lanes_of<T>;
        pack<T> value =
            pack<T>::load(basis) * start[d] + pack<T>::load(basis + static_cast<std::size_t>(K + 1) * W) * end(m)[d];
        for (int k = 0; k < K; ++k)
            value += pack<T>::load(basis + static_cast<std::size_t>(k + 1) * W)
                     * m.points[static_cast<std::size_t>(k) * n + d];
        return value;
    }
    // The straight motion's control point k of K.
    T straight(const T* to, int k, int K, int d) const { return start[d] + (to[d] - start[d]) * T(k + 1) / T(K + 1); }
};

}  // namespace SPACEARM_NAMESPACE
