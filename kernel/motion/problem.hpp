// What is asked of a motion: where it begins and may end, what it must keep, and what makes it better.
#pragma once

#include "motion/near_pairs.hpp"
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

// The names and order of the terms, as a checker's `terms` have them.
enum term {
    term_length,
    term_duration,
    term_tip,
    term_clearance,
    term_smoothness,
    term_f1,
    term_f2,
    term_f3,
    term_base_final,
    term_base_peak,
    term_base_rate,
    term_joint_momentum,
    term_count
};
template <class T> struct motion_weights {
    T length = 1;              // joint path length, integral of |q'| [rad or m]
    T duration = 0;            // the fastest uniform time within the limits, by samples [s]
    T tip = 0;                 // path length of the end effector [m]
    T clearance = 0;           // mean of what lacks to the preferred clearance, summed over pairs [m]
    T smoothness = 0;          // mean of |q'''|^2 [rad^2 or m^2]
    T f1 = 0, f2 = 0, f3 = 0;  // the paper's terms, means over the samples
    T base_final = 0;          // the base's turn at the end [rad]
    T base_peak = 0;           // its greatest turn [rad]
    T base_rate = 0;           // its fastest rate [rad/s]
    T joint_momentum = 0;      // the arm's greatest angular momentum [N m s]
    bool carried() const { return tip > 0 || clearance > 0 || f1 > 0 || f2 > 0 || f3 > 0; }
    bool of_base() const { return base_final > 0 || base_peak > 0 || base_rate > 0 || joint_momentum > 0; }
    bool only_length() const { return !(duration > 0) && !(smoothness > 0) && !carried() && !of_base(); }
};
template <class T> struct motion_term {
    const char* name;
    T motion_weights<T>::* weight;
};
template <class T>
inline constexpr motion_term<T> motion_terms[term_count] = {{"length", &motion_weights<T>::length},
                                                            {"duration", &motion_weights<T>::duration},
                                                            {"tip", &motion_weights<T>::tip},
                                                            {"clearance", &motion_weights<T>::clearance},
                                                            {"smoothness", &motion_weights<T>::smoothness},
                                                            {"f1", &motion_weights<T>::f1},
                                                            {"f2", &motion_weights<T>::f2},
                                                            {"f3", &motion_weights<T>::f3},
                                                            {"base_final", &motion_weights<T>::base_final},
                                                            {"base_peak", &motion_weights<T>::base_peak},
                                                            {"base_rate", &motion_weights<T>::base_rate},
                                                            {"joint_momentum", &motion_weights<T>::joint_momentum}};

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
    T preferred_clearance = 0;              // [m] for the clearance term
    std::vector<near_pair<T>> near_pairs;   // mostly none
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

// ---- what is asked, in double and without the model -----------------------------------------------------------------
inline constexpr int most_goals = 1'000'000;

struct motion_request {
    std::vector<double> start, goals, lower, upper, velocity, acceleration, jerk;
    double margin = 0, preferred_clearance = 0;
    near_pairs_request near_pairs;
    int tip = 0;
    std::vector<int> centers;
    motion_weights<double> weight;
    base_demands<double> base;
};

template <class T> std::vector<T> numbers_of(const std::vector<double>& from) {
    std::vector<T> out;
    for (double x : from) out.push_back(static_cast<T>(x));
    return out;
}

template <class T> base_demands<T> demands_of(const base_demands<double>& given, const model<T>& scene) {
    for (double x : {given.ends.near, given.ends.turned, given.ends.base_turned, given.most_turned, given.most_rate,
                     given.most_arm, given.momentum.duration}) {
        require(x >= 0 && x <= widest * widest, "a tolerance or limit of the base's that is none");
    }
    base_demands<T> b;
    b.kind = given.kind;
    b.momentum.duration = static_cast<T>(given.momentum.duration);
    if (given.kind == base_kind::fixed) return b;
    require(!scene.masses.joints.empty(), "no masses");
    b.ends = given.ends;
    b.free_end = b.ends.kind != frame_goal::none;
    if (b.free_end) {
        require(b.ends.joint >= 0 && b.ends.joint < static_cast<int>(scene.robot.joints.size()),
                "a goal's joint is out of range");
    }
    bool sound = all_within(b.ends.offset, widest) && all_within(b.ends.position, widest)
                 && all_within(b.ends.axis, widest) && all_within(given.momentum.angular, widest)
                 && all_within(given.momentum.drift, widest);
    for (const rotation3* r : {&b.ends.local, &b.ends.wanted}) {
        for (const auto& column : r->c) sound = sound && all_within(column, widest);
    }
    for (double x : {b.ends.attitude.w, b.ends.attitude.x, b.ends.attitude.y, b.ends.attitude.z})
        sound = sound && within(x, widest);
    require(sound, "a number of the base's that is none, or too large");
    b.most_turned = static_cast<T>(given.most_turned);
    b.most_rate = static_cast<T>(given.most_rate);
    b.most_arm = static_cast<T>(given.most_arm);
    b.momentum.any = given.momentum.any;
    require(!b.momentum.any || given.momentum.duration > 0, "a momentum without a duration");
    copy_numbers(given.momentum.angular, b.momentum.angular);
    copy_numbers(given.momentum.drift, b.momentum.drift);
    return b;
}

template <class T> motion_problem<T> problem_of(const model<T>& scene, const motion_request& given) {
    constexpr const char* unfit = "a motion's arrays do not fit";
    motion_problem<T> p;
    const std::size_t n = scene.robot.dofs, goals = given.goals.size() / n;
    p.scene = scene;
    for (const auto* numbers : {&given.start, &given.lower, &given.upper, &given.velocity, &given.acceleration})
        require(numbers->size() == n, unfit);
    require(goals >= 1 && goals <= most_goals && goals * n == given.goals.size(), unfit);
    require(given.jerk.empty() || given.jerk.size() == n, unfit);
    const int points = static_cast<int>(scene.points.size());
    require(given.tip >= 0 && given.tip < points, "the tip is no point");
    for (int i : given.centers) require(i >= 0 && i < points, "a centre is no point");
    p.start = numbers_of<T>(given.start);
    p.goals = numbers_of<T>(given.goals);
    p.lower = numbers_of<T>(given.lower);
    p.upper = numbers_of<T>(given.upper);
    p.velocity = numbers_of<T>(given.velocity);
    p.acceleration = numbers_of<T>(given.acceleration);
    p.jerk = numbers_of<T>(given.jerk);
    for (std::size_t d = 0; d < n; ++d) require(p.lower[d] <= p.upper[d], "a lower bound above the upper one");
    for (const auto* numbers : {&p.start, &p.goals, &p.lower, &p.upper})
        require(all_within(*numbers, furthest), "a joint position that is none, or too far");
    for (const auto* limits : {&p.velocity, &p.acceleration, &p.jerk}) {
        for (T limit : *limits) require(limit > T(1e-30), "a limit that is not above 0");
    }
    require(within(given.margin, widest) && within(given.preferred_clearance, widest),
            "a number that is none, or too large");
    p.margin = static_cast<T>(given.margin);
    p.preferred_clearance = static_cast<T>(given.preferred_clearance);
    p.near_pairs = near_pairs_of(scene, given.near_pairs, goals);
    p.tip = given.tip;
    p.centers = given.centers;
    for (int i = 0; i < term_count; ++i) {
        const double weight = given.weight.*motion_terms<double>[i].weight;
        require(within(weight, most_weight), "a weight that is none, or too large");
        p.weight.*motion_terms<T>[i].weight = static_cast<T>(weight);
    }
    p.base = demands_of(given.base, scene);
    return p;
}

}  // namespace SPACEARM_NAMESPACE
