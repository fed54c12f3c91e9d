// Python's arrays and the search for motions.
#pragma once

#include "python/threads.hpp"
#include "search/motion_search.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> std::vector<T> numbers_of(const in1<double>& from) {
    std::vector<T> out(from.shape(0));
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<T>(from(i));
    return out;
}

inline constexpr int most_interior = 32;
inline const char* const term_names[term_count] = {"length",     "duration",  "tip",       "clearance",
                                                   "smoothness", "f1",        "f2",        "f3",
                                                   "base_final", "base_peak", "base_rate", "joint_momentum"};

template <class T>
motion_problem<T> make_motion_problem(const model<T>& scene, in1<double> start, in2c<double> goals, in1<double> lower,
                                      in1<double> upper, in1<double> velocity, in1<double> acceleration,
                                      in1<double> jerk, double margin, double comfort, int tip,
                                      in1<std::int32_t> centers, in1<double> weights) {
    motion_problem<T> p;
    const std::size_t n = scene.robot.dofs;
    p.scene = scene;
    for (const auto& array : {start, lower, upper, velocity, acceleration})
        require(array.shape(0) == n, "a motion's arrays do not fit");
    require(goals.shape(0) >= 1 && goals.shape(0) <= 1'000'000 && goals.shape(1) == n
                && (jerk.shape(0) == n || jerk.shape(0) == 0),
            "a motion's arrays do not fit");
    require(weights.shape(0) == term_count && tip >= 0 && tip < static_cast<int>(scene.points.size()),
            "a motion's arrays do not fit");
    p.start = numbers_of<T>(start);
    p.goals.assign(goals.data(), goals.data() + goals.size());
    p.lower = numbers_of<T>(lower);
    p.upper = numbers_of<T>(upper);
    p.velocity = numbers_of<T>(velocity);
    p.acceleration = numbers_of<T>(acceleration);
    p.jerk = numbers_of<T>(jerk);
    for (std::size_t d = 0; d < n; ++d) require(p.lower[d] <= p.upper[d], "a lower bound above the upper one");
    for (const auto* numbers : {&p.start, &p.goals, &p.lower, &p.upper})
        require(all_within(*numbers, furthest), "a joint position that is none, or too far");
    for (const auto* limits : {&p.velocity, &p.acceleration, &p.jerk}) {
        for (T limit : *limits) require(limit > T(1e-30), "a limit that is not above 0");
    }
    require(within(margin, widest) && within(comfort, widest) && all_within(weights, most_weight),
            "a number that is none, or too large");
    p.margin = static_cast<T>(margin);
    p.comfort = static_cast<T>(comfort);
    p.tip = tip;
    for (std::size_t i = 0; i < centers.shape(0); ++i) {
        require(centers(i) >= 0 && centers(i) < static_cast<int>(scene.points.size()), "a centre is no point");
        p.centers.push_back(centers(i));
    }
    const std::vector<T> w = numbers_of<T>(weights);
    p.weight = {w[term_length],
                w[term_duration],
                w[term_tip],
                w[term_clearance],
                w[term_smoothness],
                {w[term_f1], w[term_f2], w[term_f3]},
                {w[term_base_final], w[term_base_peak], w[term_base_rate], w[term_joint_momentum]}};
    return p;
}

inline void take_turn(const std::vector<double>& rows, rotation3& out) {  // from nine numbers, row by row
    require(rows.size() == 9, "a rotation's numbers do not fit");
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) out.c[k][i] = rows[3 * i + k];
    }
}
inline void take3(const std::vector<double>& from, double* out) {
    require(from.size() == 3, "a vector's numbers do not fit");
    std::copy(from.begin(), from.end(), out);
}

// What is asked of a floating base: a dictionary, empty for a base that is fixed. All in the frame of the base as it
// begins.
template <class T> base_demands<T> demands_from(const nb::dict& given, const model<T>& scene) {
    base_demands<T> b;
    if (given.size() == 0) return b;
    nb::dict d;
    d.update(given);
    bool fixed = false;
    field(d, "fixed", fixed);
    if (fixed) {  // it may have to keep to a duration all the same
        field(d, "duration", b.momentum.duration);
        require(d.size() == 0, "an unknown key of the base's");
        return b;
    }
    require(!scene.masses.joints.empty(), "no masses");
    b.kind = base_kind::floating;
    std::vector<double> local, offset(3), wanted, position(3), axis(3), attitude, angular, drift;
    int kind = 0;
    field(d, "kind", kind);
    require(kind >= 0 && kind <= 3, "an unknown goal");
    b.ends.kind = static_cast<frame_goal>(kind);
    if (kind > 0) {
        field(d, "joint", b.ends.joint);
        field(d, "local", local);
        field(d, "offset", offset);
        field(d, "wanted", wanted);
        field(d, "position", position);
        field(d, "axis", axis);
        field(d, "near", b.ends.near);
        field(d, "turned", b.ends.turned);
        require(b.ends.joint >= 0 && b.ends.joint < static_cast<int>(scene.robot.joints.size()),
                "a goal's joint is out of range");
        take_turn(local, b.ends.local);
        take_turn(wanted, b.ends.wanted);
        take3(offset, b.ends.offset);
        take3(position, b.ends.position);
        take3(axis, b.ends.axis);
        b.free_end = true;
    }
    field(d, "attitude", attitude);
    if (!attitude.empty()) {
        require(attitude.size() == 4, "an attitude's numbers do not fit");
        b.ends.base = true;
        b.ends.attitude = {attitude[0], attitude[1], attitude[2], attitude[3]};
        field(d, "attitude_turned", b.ends.base_turned);
        field(d, "attitude_within", b.ends.base_within);
    }
    field(d, "most_turned", b.most_turned);
    field(d, "most_rate", b.most_rate);
    field(d, "most_arm", b.most_arm);
    field(d, "duration", b.momentum.duration);
    field(d, "angular", angular);
    field(d, "drift", drift);
    if (!angular.empty()) {
        require(angular.size() == 3 && drift.size() == 3 && b.momentum.duration > 0, "a momentum's numbers do not fit");
        b.momentum.any = true;
        for (int k = 0; k < 3; ++k) {
            b.momentum.angular[k] = static_cast<T>(angular[k]);
            b.momentum.drift[k] = static_cast<T>(drift[k]);
        }
    }
    require(d.size() == 0, "an unknown key of the base's");
    for (double x : {b.ends.near, b.ends.turned, b.ends.base_turned, double(b.most_turned), double(b.most_rate),
                     double(b.most_arm), double(b.momentum.duration)}) {
        require(x >= 0 && x <= widest * widest, "a tolerance or limit of the base's that is none");
    }
    for (const auto* numbers : {&local, &offset, &wanted, &position, &axis, &attitude, &angular, &drift}) {
        require(all_within(*numbers, widest), "a number of the base's that is none, or too large");
    }
    return b;
}

// Rows of K n numbers; with n more where they end.
template <class T>
motion<T> motion_from(const motion_problem<T>& p, const T* row, int interior, int goal, bool own_end) {
    const T* end = row + static_cast<std::size_t>(interior) * p.dofs();
    motion<T> m{interior, goal, std::vector<T>(row, end)};
    if (own_end) m.end.assign(end, end + p.dofs());
    return m;
}
template <class T> bool has_own_end(const motion_problem<T>& p, const in2c<T>& rows, int interior, int goal) {
    require(interior >= 0 && interior <= most_interior, "a number of control points out of range");
    require(goal >= 0 && goal < p.goal_count(), "no such goal");
    const std::size_t n = p.dofs(), plain = static_cast<std::size_t>(interior) * n;
    require(rows.shape(1) == plain || rows.shape(1) == plain + n, "wrong number of dimensions");
    return rows.shape(1) != plain;
}

// A search, and whose turn it is.
template <class T> struct shared_search {
    motion_search<T> search;
    one_at_a_time turn;
    shared_search(motion_problem<T> problem, motion_search_settings settings, std::uint64_t seed, std::uint32_t island)
        : search(std::move(problem), std::move(settings), seed, island) {}
    const motion_problem<T>& problem() { return search.checker().problem(); }  // never changes
};

// Where the base is at the nodes of motions: (m, nodes + 1, 7), position and attitude wxyz in the frame of the base as
// it begins. Of the last node alone with `ends_only`, so that nothing but the kernel's own time counts: (m, 1, 7).
template <class T>
nb::object base_along(shared_search<T>& s, in2c<T> rows, int interior, int goal, int nodes, bool ends_only) {
    const motion_problem<T>& p = s.problem();
    const bool own_end = has_own_end(p, rows, interior, goal);
    require(nodes >= 16 && nodes <= 4096 && nodes % 16 == 0, "a number of nodes that is none");
    const std::size_t count = rows.shape(0), wanted = ends_only ? 1 : nodes + 1;
    std::vector<T> out(count * wanted * 7);
    s.turn([&] {
        listener signals;
        base_model<T>& base = s.search.checker().base();
        for (std::size_t i = 0; i < count; ++i) {
            signals.ask();
            base.poses(motion_from(p, rows.data() + i * rows.shape(1), interior, goal, own_end), nodes, ends_only,
                       &out[i * wanted * 7]);
        }
    });
    return array_of(std::move(out), {count, wanted, 7});
}

// A motion moved until its ends are met: its numbers, the end's included where that is free; and whether they are.
template <class T> nb::object settled(shared_search<T>& s, in2c<T> rows, int interior, int goal) {
    motion_checker<T>& checker = s.search.checker();
    const motion_problem<T>& p = s.problem();
    const bool own_end = has_own_end(p, rows, interior, goal);
    const std::size_t count = rows.shape(0),
                      width = static_cast<std::size_t>(interior + (p.base.free_end ? 1 : 0)) * p.dofs();
    std::vector<T> out;
    std::vector<char> there;
    s.turn([&] {
        listener signals;
        for (std::size_t i = 0; i < count; ++i) {
            motion<T> m = motion_from(p, rows.data() + i * rows.shape(1), interior, goal, own_end);
            if (p.base.free_end && m.end.empty()) m.end.assign(p.goal(goal), p.goal(goal) + p.dofs());
            checker.solver().forget();
            there.push_back(checker.project_onto_ends(m, checker.solver(), [&] {
                signals.ask();
                return true;
            }));
            out.insert(out.end(), m.points.begin(), m.points.end());
            if (p.base.free_end) out.insert(out.end(), m.end.begin(), m.end.end());
        }
    });
    nb::list met;
    for (char one : there) met.append(nb::bool_(one != 0));
    return nb::make_tuple(array_of(std::move(out), {count, width}), met);
}

template <class T>
nb::object points_of(const motion<T>& m, int dofs) {  // the interior ones; one more where it has an end of its own
    std::vector<T> all = m.points;
    all.insert(all.end(), m.end.begin(), m.end.end());
    return array_of(std::move(all),
                    {static_cast<std::size_t>(m.interior + !m.end.empty()), static_cast<std::size_t>(dofs)});
}

// Fitness, violation and terms of many motions: rows of K n numbers.
template <class T> nb::object judge_motions(shared_search<T>& s, in2c<T> rows, int interior, int goal) {
    motion_checker<T>& checker = s.search.checker();
    const motion_problem<T>& p = s.problem();
    const bool own_end = has_own_end(p, rows, interior, goal);
    const std::size_t count = rows.shape(0);
    std::vector<T> fitness(count), violation(count), terms(count * term_count);
    std::vector<char> fine(count);
    s.turn([&] {
        listener signals;
        for (std::size_t i = 0; i < count; ++i) {
            signals.ask();
            const motion<T> m = motion_from(p, rows.data() + i * rows.shape(1), interior, goal, own_end);
            fitness[i] = checker.fitness(m, true, &terms[i * term_count]);
            violation[i] = checker.violation(m, std::numeric_limits<T>::infinity());
            fine[i] = violation[i] <= T(0) && checker.finely_free(m);
        }
    });
    nb::dict out;
    nb::list finely;
    for (char f : fine) finely.append(nb::bool_(f != 0));
    out["fitness"] = array_of(std::move(fitness), {count});
    out["violation"] = array_of(std::move(violation), {count});
    out["terms"] = array_of(std::move(terms), {count, static_cast<std::size_t>(term_count)});
    out["free"] = finely;
    return out;
}

// A motion with what it is worth, as a dictionary; None if there is none. take(search) gives the two.
template <class T, class Take> nb::object with_worth(shared_search<T>& s, const char* name, Take&& take) {
    std::optional<std::pair<T, motion<T>>> found;
    s.turn([&] { found = take(s.search); });
    if (!found) return nb::none();
    nb::dict d;
    d[name] = found->first;
    d["goal"] = found->second.goal;
    d["points"] = points_of(found->second, s.problem().dofs());
    return d;
}
template <class T, class Take> auto taken(shared_search<T>& s, Take&& take) {
    decltype(take(s.search)) out{};
    s.turn([&] { out = take(s.search); });
    return out;
}

inline motion_search_settings motion_settings_from(const nb::dict& given, const swarm_settings& swarm) {
    nb::dict d;
    d.update(given);
    motion_search_settings s;
    s.swarm = swarm;
    field(d, "probe_step", s.trees.step);
    field(d, "probe_near_line", s.trees.near_line);
    field(d, "probe_spread", s.trees.spread);
    field(d, "patience", s.patience);
    field(d, "interior", s.interior);
    field(d, "ladder", s.ladder);
    field(d, "refine_stall", s.refine_stall);
    field(d, "swarm_turn", s.swarm_turn);
    field(d, "swarm_stall", s.swarm_stall);
    field(d, "give_up", s.give_up);
    field(d, "detour", s.detour);
    field(d, "shake", s.shake);
    field(d, "swarm_spread", s.swarm_spread);
    require(d.size() == 0, "an unknown setting");
    require(!s.interior.empty() && !s.ladder.empty(), "no number of control points");
    for (const auto& list : {s.interior, s.ladder}) {
        require(list.size() <= 1000, "too many numbers of control points");
        for (int k : list) require(k >= 1 && k <= most_interior, "a number of control points out of range");
    }
    constexpr int often = 1'000'000;
    const auto counted = [](int n, int least) { return n >= least && n <= often; };
    require(s.trees.step >= 1e-3 && s.trees.step <= 1e3 && counted(s.patience, 0) && counted(s.swarm_turn, 0)
                && counted(s.swarm_stall, 0) && counted(s.refine_stall, 1),
            "settings out of range");
    for (double x : {s.trees.near_line, s.trees.spread, s.give_up, s.detour, s.shake, s.swarm_spread})
        require(x >= 0 && x <= 1e6, "settings out of range");
    return s;
}

template <class T> void bind_motion_search(nb::module_& m, const std::string& suffix) {
    using search_type = shared_search<T>;
    nb::class_<search_type>(m, ("MotionSearch" + suffix).c_str())
        .def(
            "__init__",
            [](search_type* self, const model<T>& scene, in1<double> start, in2c<double> goals, in1<double> lower,
               in1<double> upper, in1<double> velocity, in1<double> acceleration, in1<double> jerk, double margin,
               double comfort, int tip, in1<std::int32_t> centers, in1<double> weights, const nb::dict& base,
               const nb::dict& settings, const swarm_settings& swarm, std::uint64_t seed, std::uint32_t island) {
                motion_problem<T> p = make_motion_problem<T>(scene, start, goals, lower, upper, velocity, acceleration,
                                                             jerk, margin, comfort, tip, centers, weights);
                p.base = demands_from<T>(base, scene);
                new (self) search_type(std::move(p), motion_settings_from(settings, swarm), seed, island);
            },
            "scene"_a, "start"_a, "goals"_a, "lower"_a, "upper"_a, "velocity"_a, "acceleration"_a, "jerk"_a, "margin"_a,
            "comfort"_a, "tip"_a, "centers"_a, "weights"_a, "base"_a, "settings"_a, "swarm"_a, "seed"_a, "island"_a)
        .def(
            "run",
            [](search_type& s, std::int64_t evaluations, double seconds, bool until_first, std::int64_t stall,
               nb::object progress) {
                require(evaluations >= 0 && evaluations <= most_evaluations && seconds >= 0 && stall >= 0,
                        "a budget out of range");
                const motion_budget budget{evaluations, seconds, until_first, stall};
                bool interrupted = false, failed = false;
                const std::function<bool()> go_on = [&] {
                    nb::gil_scoped_acquire hold;
                    if (PyErr_CheckSignals() != 0) {
                        interrupted = true;
                        return false;
                    }
                    if (progress.is_none()) return true;
                    try {
                        const nb::object answer = progress(s.search.evaluations());
                        return !answer.is(nb::bool_(false));
                    } catch (nb::python_error& error) {
                        error.restore();
                        failed = true;
                        return false;
                    }
                };
                s.turn([&] { s.search.run(budget, go_on); });
                if (interrupted || failed) throw nb::python_error();
            },
            "evaluations"_a, "seconds"_a, "until_first"_a, "stall"_a, "progress"_a.none())
        .def("add_instant",
             [](search_type& s, double at, double spread) {
                 require(at >= 0 && at <= 1 && spread >= 0 && spread <= 1, "an instant out of range");
                 s.turn([&] { s.search.add_instant(at, spread); });
             })
        .def("judge", &judge_motions<T>)
        .def("base_along", &base_along<T>, "rows"_a, "interior"_a, "goal"_a, "nodes"_a, "ends_only"_a)
        .def("settled", &settled<T>, "rows"_a, "interior"_a, "goal"_a)
        .def_prop_ro("best",
                     [](search_type& s) {
                         return with_worth(s, "fitness", [](motion_search<T>& of) {
                             return of.found() ? std::make_optional(std::pair(of.best_fitness(), of.best()))
                                               : std::nullopt;
                         });
                     })
        .def_prop_ro("optimal",
                     [](search_type& s) { return taken(s, [](motion_search<T>& of) { return of.optimal(); }); })
        .def_prop_ro("evaluations",
                     [](search_type& s) { return taken(s, [](motion_search<T>& of) { return of.evaluations(); }); })
        .def_prop_ro("configurations",
                     [](search_type& s) { return taken(s, [](motion_search<T>& of) { return of.configurations(); }); })
        .def_prop_ro("seconds",
                     [](search_type& s) { return taken(s, [](motion_search<T>& of) { return of.seconds(); }); })
        .def_prop_ro("fallback",
                     [](search_type& s) {
                         return with_worth(s, "violation", [](motion_search<T>& of) {
                             return of.has_fallback()
                                        ? std::make_optional(std::pair(of.fallback_violation(), of.fallback()))
                                        : std::nullopt;
                         });
                     })
        .def_prop_ro("history", [](search_type& s) {
            const int dofs = s.problem().dofs();
            nb::list out;
            for (const auto& r : taken(s, [](motion_search<T>& of) { return of.history(); })) {
                out.append(
                    nb::make_tuple(r.seconds, r.evaluations, r.fitness, r.by, r.found.goal, points_of(r.found, dofs)));
            }
            return out;
        });
    if (!nb::hasattr(m, "motion_terms")) {
        nb::list names;
        for (const char* name : term_names) names.append(name);
        m.attr("motion_terms") = names;
    }
}

// Values of the spline's basis, (m, K + 2), for the tests.
inline nb::object spline_values(in1<double> s, int interior, int derivative) {
    require(interior >= 0 && interior <= most_interior && derivative >= 0 && derivative <= 5, "out of range");
    std::vector<double> out;
    for (std::size_t i = 0; i < s.shape(0); ++i) {
        require(s(i) >= 0 && s(i) <= 1, "an instant out of range");
        const std::vector<double> row = spline_basis(s(i), interior, derivative);
        out.insert(out.end(), row.begin(), row.end());
    }
    return array_of(std::move(out), {s.shape(0), static_cast<std::size_t>(interior + 2)});
}

}  // namespace SPACEARM_NAMESPACE
