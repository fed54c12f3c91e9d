// Python's arrays and the search for motions.
#pragma once

#include "python/bind_world.hpp"
#include "python/threads.hpp"
#include "search/motion_search.hpp"

namespace SPACEARM_NAMESPACE {

// ---- what is asked --------------------------------------------------------------------------------------------------
// The two base models' demands, each a class of its own in Python.
struct fixed_demands {
    base_demands<double> demands;
};
struct floating_demands {
    base_demands<double> demands;
};
struct attitude_goal {
    quaternion attitude;
    double tolerance = 0;
    bool anywhere_within = false;
};

inline rotation3 rotation_from(const in_matrix& rows) {
    rotation3 out;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) out.c[k][i] = rows(i, k);
    }
    return out;
}
inline terminal_constraints frame_goal_from(frame_goal kind, int joint, in_matrix local, in_vector offset,
                                            in_matrix wanted, in_vector position, in_vector axis,
                                            double position_tolerance, double angle_tolerance) {
    terminal_constraints out;
    out.kind = kind;
    out.joint = joint;
    out.local = rotation_from(local);
    out.wanted = rotation_from(wanted);
    take(offset, out.offset);
    take(position, out.position);
    take(axis, out.axis);
    out.near = position_tolerance;
    out.turned = angle_tolerance;
    return out;
}
inline attitude_goal attitude_goal_from(fixed_array<4> wxyz, double tolerance, bool anywhere_within) {
    return {{wxyz(0), wxyz(1), wxyz(2), wxyz(3)}, tolerance, anywhere_within};
}

inline void bind_demands(nb::module_& m) {
    nb::enum_<frame_goal>(m, "FrameGoalKind")
        .value("position", frame_goal::position)
        .value("axis", frame_goal::axis)
        .value("pose", frame_goal::pose);
    bind_part(m, "FrameGoal",
              "Where a frame is to be at the end: its axes `local` and origin `offset` in the frame of the joint that "
              "carries it, those wanted in the frame of the base at the beginning; `axis` is the free one.",
              &frame_goal_from, "kind"_a, "joint"_a, "local"_a, "offset"_a, "wanted"_a, "position"_a, "axis"_a,
              "position_tolerance"_a, "angle_tolerance"_a);
    bind_part(m, "AttitudeGoal",
              "How the base is to stand at the end, in its frame at the beginning [rad]; `anywhere_within`: all "
              "attitudes within the tolerance are as good.",
              &attitude_goal_from, "wxyz"_a, "tolerance"_a, "anywhere_within"_a);
    nb::class_<fixed_demands>(m, "FixedBase",
                              "A base that does not move; 0 s: the motion may last as long as it likes.")
        .def(
            "__init__",
            [](fixed_demands* self, double duration) {
                new (self) fixed_demands{};
                self->demands.momentum.duration = duration;
            },
            nb::kw_only(), "duration"_a = 0.0);
    nb::class_<floating_demands>(
        m, "FloatingBase",
        "A base that floats, and what is asked of it; a limit of 0 is none. All in the frame of "
        "the base at the beginning.")
        .def(
            "__init__",
            [](floating_demands* self, const terminal_constraints* frame, const attitude_goal* attitude,
               double most_turned, double most_rate, double most_arm_momentum, double duration,
               std::optional<in_vector> angular, std::optional<in_vector> drift) {
                base_demands<double> b;
                b.kind = base_kind::floating;
                if (frame) b.ends = *frame;
                if (attitude) {
                    b.ends.base = true;
                    b.ends.attitude = attitude->attitude;
                    b.ends.base_turned = attitude->tolerance;
                    b.ends.base_within = attitude->anywhere_within;
                }
                b.most_turned = most_turned;
                b.most_rate = most_rate;
                b.most_arm = most_arm_momentum;
                b.momentum.duration = duration;
                require(angular.has_value() == drift.has_value(), "a momentum is an angular one and a drift");
                if (angular) {
                    b.momentum.any = true;
                    take(*angular, b.momentum.angular);
                    take(*drift, b.momentum.drift);
                }
                new (self) floating_demands{b};
            },
            nb::kw_only(), "frame"_a = nb::none(), "attitude"_a = nb::none(), "most_turned"_a = 0.0,
            "most_rate"_a = 0.0, "most_arm_momentum"_a = 0.0, "duration"_a = 0.0, "angular"_a = nb::none(),
            "drift"_a = nb::none());
}

inline void bind_weights(nb::module_& m) {
    using w = motion_weights<double>;
    nb::class_<w> c(m, "MotionWeights",
                    "What a motion's fitness weighs: its terms, 0 or more; `length` is 1 unless set.");
    c.def(nb::init<>());
    for (const auto& term : motion_terms<double>) c.def_rw(term.name, term.weight);
    nb::list names;
    for (const auto& term : motion_terms<double>) names.append(term.name);
    m.attr("motion_terms") = nb::tuple(names);
}

inline near_pairs_request near_pairs_from(in_ints pair, in_ints body, in_ints obstacle, in_ints other,
                                          in1<double> required, in1<double> at_start, in2c<double> at_goal) {
    const std::size_t rows = pair.shape(0);
    require_lengths(rows, {body.shape(0), obstacle.shape(0), other.shape(0)}, "the near pairs' arrays do not fit");
    require_lengths(required.shape(0), {at_start.shape(0), at_goal.shape(0)}, "the near pairs' arrays do not fit");
    near_pairs_request out{
        {}, vector_of(required), vector_of(at_start), {at_goal.data(), at_goal.data() + at_goal.size()}};
    for (std::size_t i = 0; i < rows; ++i) out.rows.push_back({pair(i), body(i), obstacle(i), other(i)});
    return out;
}

inline void bind_request(nb::module_& m) {
    bind_part(m, "NearPairs",
              "Pairs that are nearer at an end of a motion than `required`, p of them. A motion holds such a pair to "
              "`at_start` until it is first `required` apart, to `at_goal` (p, goals) from when it is last so, and to "
              "`required` in between; to the lesser of both if it never is [m]. At an end where a pair is not near, "
              "give `required`. Rows say what belongs to a pair: all bodies of its link, with all of the kernel's "
              "obstacles that its obstacle is, or with other bodies where the obstacle is -1. Trees and edges know no "
              "order: there the pair's own margin holds (PairMargins), which has to be the least of the above.",
              &near_pairs_from, "pair"_a, "body"_a, "obstacle"_a, "other"_a, "required"_a, "at_start"_a, "at_goal"_a);
    nb::class_<motion_request>(m, "MotionProblem", "What is asked of a motion.")
        .def(
            "__init__",
            [](motion_request* self, in1<double> start, in2c<double> goals, in1<double> lower, in1<double> upper,
               in1<double> velocity, in1<double> acceleration, std::optional<in1<double>> jerk, double margin,
               double preferred_clearance, int tip, in_ints centers, const motion_weights<double>& weights,
               std::variant<fixed_demands, floating_demands> base, const near_pairs_request* near_pairs) {
                require(goals.shape(1) == start.shape(0), "a motion's arrays do not fit");
                motion_request made;
                made.start = vector_of(start);
                made.goals.assign(goals.data(), goals.data() + goals.size());
                made.lower = vector_of(lower);
                made.upper = vector_of(upper);
                made.velocity = vector_of(velocity);
                made.acceleration = vector_of(acceleration);
                if (jerk) made.jerk = vector_of(*jerk);
                made.margin = margin;
                made.preferred_clearance = preferred_clearance;
                if (near_pairs) made.near_pairs = *near_pairs;
                made.tip = tip;
                made.centers = vector_of(centers);
                made.weight = weights;
                made.base = std::visit([](const auto& given) { return given.demands; }, base);
                new (self) motion_request(std::move(made));
            },
            nb::kw_only(), "start"_a, "goals"_a, "lower"_a, "upper"_a, "velocity"_a, "acceleration"_a,
            "jerk"_a = nb::none(), "margin"_a, "preferred_clearance"_a, "tip"_a, "centers"_a, "weights"_a, "base"_a,
            "near_pairs"_a = nb::none());
}

inline void bind_search_settings(nb::module_& m) {
    using s = motion_search_settings;
    const auto tree = [](double rrt_connect_settings::* field) {
        return std::pair([field](const s& of) { return of.trees.*field; },
                         [field](s& of, double value) { of.trees.*field = value; });
    };
    const auto step = tree(&rrt_connect_settings::step), near = tree(&rrt_connect_settings::near_line),
               spread = tree(&rrt_connect_settings::spread);
    nb::class_<s>(m, "SearchSettings",
                  "Settings of a search, all with defaults; search_settings.hpp says what each is.")
        .def(nb::init<>())
        .def_rw("swarm", &s::swarm)
        .def_prop_rw("tree_step", step.first, step.second)
        .def_prop_rw("tree_near_line", near.first, near.second)
        .def_prop_rw("tree_spread", spread.first, spread.second)
        .def_rw("interior", &s::interior)
        .def_rw("ladder", &s::ladder)
        .def_rw("patience", &s::patience)
        .def_rw("first_turn", &s::first_turn)
        .def_rw("swarm_share", &s::swarm_share)
        .def_rw("shortcuts", &s::shortcuts)
        .def_rw("shortcut_stall", &s::shortcut_stall)
        .def_rw("refine_stall", &s::refine_stall)
        .def_rw("swarm_every", &s::swarm_every)
        .def_rw("swarm_stall", &s::swarm_stall)
        .def_rw("give_up", &s::give_up)
        .def_rw("detour", &s::detour)
        .def_rw("shake", &s::shake)
        .def_rw("swarm_spread", &s::swarm_spread)
        .def(
            "check", [](const s& given) { require_sound(given); }, "Raises ValueError where a number is out of range.");
}

// ---- what is found --------------------------------------------------------------------------------------------------
template <class T> struct found_motion {
    T fitness, violation;
    motion<T> at;
    int dofs;
};
template <class T> struct improvement {
    motion_record<T> record;
    int dofs;
};
template <class T> struct judgement {
    std::vector<T> fitness, violation, terms;
    std::vector<char> free;
};
template <class T> struct projection {
    std::vector<T> points;
    std::size_t width;
    std::vector<char> met;
};

// The interior control points; one more where it has an end of its own.
template <class T> out_array<T, 2> points_of(const motion<T>& m, int dofs) {
    std::vector<T> all = m.points;
    all.insert(all.end(), m.end.begin(), m.end.end());
    return array_of<T, 2>(std::move(all),
                          {static_cast<std::size_t>(m.interior + !m.end.empty()), static_cast<std::size_t>(dofs)});
}

template <class T> void bind_found(nb::module_& m, const std::string& suffix) {
    using found = found_motion<T>;
    using entry = improvement<T>;
    using judged = judgement<T>;
    using projected = projection<T>;
    nb::class_<found>(m, ("FoundMotion" + suffix).c_str(), "A motion, and what it is worth.")
        .def_ro("fitness", &found::fitness, "Infinite where the motion is not free.")
        .def_ro("violation", &found::violation, "0 where it is free [m].")
        .def_prop_ro("goal", [](const found& f) { return f.at.goal; })
        .def_prop_ro(
            "points", [](const found& f) { return points_of(f.at, f.dofs); }, nb::rv_policy::move,
            "The interior control points, and the end where that is free (K, n).");
    nb::class_<entry>(m, ("Improvement" + suffix).c_str(), "A motion that was the best when it was found.")
        .def_prop_ro("seconds", [](const entry& e) { return e.record.seconds; })
        .def_prop_ro("evaluations", [](const entry& e) { return e.record.evaluations; })
        .def_prop_ro("fitness", [](const entry& e) { return e.record.fitness; })
        .def_prop_ro(
            "by", [](const entry& e) { return e.record.by; }, "straight, rrt_connect, refine or swarm.")
        .def_prop_ro("goal", [](const entry& e) { return e.record.found.goal; })
        .def_prop_ro("points", [](const entry& e) { return points_of(e.record.found, e.dofs); }, nb::rv_policy::move);
    nb::class_<judged>(m, ("Judgement" + suffix).c_str(), "What motions are worth, one a row.")
        .def_prop_ro(
            "fitness", [](const judged& j) { return row_of(j.fitness); }, nb::rv_policy::move)
        .def_prop_ro(
            "violation", [](const judged& j) { return row_of(j.violation); }, nb::rv_policy::move)
        .def_prop_ro(
            "terms",
            [](const judged& j) {
                return array_of<T, 2>(std::vector<T>(j.terms), {j.fitness.size(), std::size_t(term_count)});
            },
            nb::rv_policy::move, "(rows, terms), in the order of `motion_terms`.")
        .def_prop_ro("free", [](const judged& j) { return truths_of(j.free); }, nb::rv_policy::move);
    nb::class_<projected>(m, ("Projection" + suffix).c_str(), "Motions projected onto their terminal constraints.")
        .def_prop_ro(
            "points",
            [](const projected& p) { return array_of<T, 2>(std::vector<T>(p.points), {p.met.size(), p.width}); },
            nb::rv_policy::move)
        .def_prop_ro("met", [](const projected& p) { return truths_of(p.met); }, nb::rv_policy::move);
}

// ---- the search -----------------------------------------------------------------------------------------------------
// A search, and whose turn it is.
template <class T> struct shared_search {
    motion_search<T> search;
    one_at_a_time turn;
    shared_search(motion_problem<T> problem, motion_search_settings settings, std::uint64_t seed, std::uint32_t island)
        : search(std::move(problem), std::move(settings), seed, island) {}
    const motion_problem<T>& problem() { return search.checker().problem(); }  // never changes
};

// Motions as rows of K n numbers; with n more where they end.
template <class T> class motion_rows {
  public:
    motion_rows(const motion_problem<T>& p, const in2c<T>& rows, int interior, int goal)
        : p_(p), rows_(rows), interior_(interior), goal_(goal) {
        require(interior >= 0 && interior <= most_interior, "a number of control points out of range");
        require(goal >= 0 && goal < p.goal_count(), "no such goal");
        const std::size_t n = p.dofs(), plain = static_cast<std::size_t>(interior) * n;
        require(rows.shape(1) == plain || rows.shape(1) == plain + n, "wrong number of dimensions");
        own_end_ = rows.shape(1) != plain;
    }
    std::size_t count() const { return rows_.shape(0); }
    motion<T> operator[](std::size_t i) const {
        const T *row = rows_.data() + i * rows_.shape(1), *end = row + static_cast<std::size_t>(interior_) * p_.dofs();
        motion<T> m{interior_, goal_, std::vector<T>(row, end)};
        if (own_end_) m.end.assign(end, end + p_.dofs());
        return m;
    }

  private:
    const motion_problem<T>& p_;
    const in2c<T>& rows_;
    int interior_, goal_;
    bool own_end_ = false;
};

template <class T>
out_array<T, 3> base_along(shared_search<T>& s, in2c<T> rows, int interior, int goal, int nodes, bool ends_only) {
    require(nodes >= 16 && nodes <= 4096 && nodes % 16 == 0, "a number of nodes that is none");
    const motion_rows<T> motions(s.problem(), rows, interior, goal);
    const std::size_t wanted = ends_only ? 1 : nodes + 1;
    std::vector<T> out(motions.count() * wanted * 7);
    s.turn([&] {
        signal_listener signals;
        base_model<T>& base = s.search.checker().base();
        for (std::size_t i = 0; i < motions.count(); ++i) {
            signals.ask();
            base.poses(motions[i], nodes, ends_only, &out[i * wanted * 7]);
        }
    });
    return array_of<T, 3>(std::move(out), {motions.count(), wanted, 7});
}

template <class T> projection<T> project(shared_search<T>& s, in2c<T> rows, int interior, int goal) {
    motion_checker<T>& checker = s.search.checker();
    const motion_problem<T>& p = s.problem();
    const motion_rows<T> motions(p, rows, interior, goal);
    projection<T> out{{}, static_cast<std::size_t>(interior + (p.base.free_end ? 1 : 0)) * p.dofs(), {}};
    s.turn([&] {
        signal_listener signals;
        for (std::size_t i = 0; i < motions.count(); ++i) {
            motion<T> m = motions[i];
            if (p.base.free_end && m.end.empty()) m.end.assign(p.goal(goal), p.goal(goal) + p.dofs());
            checker.solver().forget();
            out.met.push_back(checker.project_onto_ends(m, checker.solver(), [&] {
                signals.ask();
                return true;
            }));
            out.points.insert(out.points.end(), m.points.begin(), m.points.end());
            if (p.base.free_end) out.points.insert(out.points.end(), m.end.begin(), m.end.end());
        }
    });
    return out;
}

template <class T> judgement<T> judge(shared_search<T>& s, in2c<T> rows, int interior, int goal) {
    motion_checker<T>& checker = s.search.checker();
    const motion_rows<T> motions(s.problem(), rows, interior, goal);
    const std::size_t count = motions.count();
    judgement<T> out{std::vector<T>(count), std::vector<T>(count), std::vector<T>(count * term_count),
                     std::vector<char>(count)};
    s.turn([&] {
        signal_listener signals;
        for (std::size_t i = 0; i < count; ++i) {
            signals.ask();
            const motion<T> m = motions[i];
            out.fitness[i] = checker.fitness(m, true, &out.terms[i * term_count]);
            out.violation[i] = checker.violation(m, std::numeric_limits<T>::infinity());
            out.free[i] = out.violation[i] <= T(0) && checker.finely_free(m);
        }
    });
    return out;
}

template <class T>
void run(shared_search<T>& s, std::int64_t evaluations, double seconds, bool until_first, std::int64_t stall,
         progress_function progress) {
    require(evaluations >= 0 && evaluations <= most_evaluations && seconds >= 0 && stall >= 0, "a budget out of range");
    bool interrupted = false, failed = false;
    const std::function<bool()> go_on = [&] {
        nb::gil_scoped_acquire hold;
        if (PyErr_CheckSignals() != 0) {
            interrupted = true;
            return false;
        }
        if (!progress) return true;
        try {
            const nb::object answer = (*progress)(s.search.evaluations());
            return !answer.is(nb::bool_(false));
        } catch (nb::python_error& error) {
            error.restore();
            failed = true;
            return false;
        }
    };
    s.turn([&] { s.search.run({evaluations, seconds, until_first, stall}, go_on); });
    if (interrupted || failed) throw nb::python_error();
}

template <class T, class Take> auto taken(shared_search<T>& s, Take&& take) {
    decltype(take(s.search)) out{};
    s.turn.look([&] { out = take(s.search); });
    return out;
}

template <class T> std::optional<found_motion<T>> best_of(shared_search<T>& s) {
    const int dofs = s.problem().dofs();
    return taken(s, [&](motion_search<T>& of) -> std::optional<found_motion<T>> {
        if (!of.found()) return std::nullopt;
        return found_motion<T>{of.best_fitness(), T(0), of.best(), dofs};
    });
}
template <class T> std::optional<found_motion<T>> fallback_of(shared_search<T>& s) {
    const int dofs = s.problem().dofs();
    return taken(s, [&](motion_search<T>& of) -> std::optional<found_motion<T>> {
        if (!of.has_fallback()) return std::nullopt;
        return found_motion<T>{std::numeric_limits<T>::infinity(), of.fallback_violation(), of.fallback(), dofs};
    });
}
template <class T> std::vector<improvement<T>> history_of(shared_search<T>& s) {
    std::vector<improvement<T>> out;
    for (auto& record : taken(s, [](motion_search<T>& of) { return of.history(); }))
        out.push_back({std::move(record), s.problem().dofs()});
    return out;
}

template <class T> path<T> path_from(const motion_problem<T>& p, const in2c<T>& corners, int goal) {
    require(corners.shape(0) >= 2 && corners.shape(1) == static_cast<std::size_t>(p.dofs()), "a path that is none");
    require(goal >= 0 && goal < p.goal_count(), "no such goal");
    path<T> out{{corners.data(), corners.data() + corners.size()}, goal};
    require(all_within(out.points, furthest), "a joint position that is none, or too far");
    return out;
}

// What became of a path of straight edges: a motion along it, or why there is none.
template <class T> struct followed_path {
    blended_path<T> at;
    int dofs;
};
template <class T> followed_path<T> blend_corners(shared_search<T>& s, in2c<T> corners, int goal) {
    const path<T> along = path_from(s.problem(), corners, goal);
    followed_path<T> out{{}, s.problem().dofs()};
    s.turn([&] {
        signal_listener signals;
        out.at = path_motions<T>(s.search.checker()).blend_corners(along, [&] {
            signals.ask();
            return true;
        });
    });
    return out;
}
// A path pruned, and shortened by random shortcuts; for the tests.
template <class T>
out_array<T, 2> shorten(shared_search<T>& s, in2c<T> corners, int goal, int shortcuts, std::uint64_t seed) {
    path<T> along = path_from(s.problem(), corners, goal);
    require(shortcuts >= 0 && shortcuts <= 1'000'000, "a number of shortcuts out of range");
    s.turn([&] {
        signal_listener signals;
        const auto still = [&] {
            signals.ask();
            return true;
        };
        rrt_connect<T> edges(s.search.checker(), {});
        path_shortener<T> shortener(edges, s.problem().dofs());
        search_sequence<T> random({seed, 0, stream::refining}, {});
        shortener.prune(along, still);
        shortener.shorten(along, shortcuts, shortcuts, random, still);
    });
    const std::size_t n = s.problem().dofs(), count = along.points.size() / n;
    return array_of<T, 2>(std::move(along.points), {count, n});
}
template <class T>
out_array<T, 2> with_interior(shared_search<T>& s, in2c<T> rows, int interior, int goal, int wanted) {
    require(wanted >= 0 && wanted <= most_interior, "a number of control points out of range");
    const motion_rows<T> motions(s.problem(), rows, interior, goal);
    std::vector<T> out;
    s.turn([&] {
        path_motions<T> fitting(s.search.checker());
        for (std::size_t i = 0; i < motions.count(); ++i) {
            const motion<T> m = fitting.with_interior(motions[i], wanted);
            out.insert(out.end(), m.points.begin(), m.points.end());
        }
    });
    return array_of<T, 2>(std::move(out), {motions.count(), static_cast<std::size_t>(wanted) * s.problem().dofs()});
}

template <class T> void bind_followed_path(nb::module_& m, const std::string& suffix) {
    using followed = followed_path<T>;
    nb::class_<followed>(m, ("FollowedPath" + suffix).c_str(), "What became of a path of straight edges.")
        .def_prop_ro(
            "outcome",
            [](const followed& f) {
                static constexpr const char* names[] = {"free", "blocked", "unmet", "unfinished"};
                return names[static_cast<int>(f.at.outcome)];
            },
            "free; blocked: the path itself is not; unmet: something else than clearance; unfinished: too many "
            "corners.")
        .def_prop_ro(
            "points", [](const followed& f) { return points_of(f.at.found, f.dofs); }, nb::rv_policy::move)
        .def_prop_ro(
            "edge", [](const followed& f) { return f.at.edge; }, "Where it is blocked; -1: it is not.")
        .def_prop_ro(
            "at", [](const followed& f) { return row_of(f.at.at); }, nb::rv_policy::move)
        .def_prop_ro("looks", [](const followed& f) { return f.at.looks; });
}

template <class T> void bind_motion_search(nb::module_& m, const std::string& suffix) {
    using search = shared_search<T>;
    bind_found<T>(m, suffix);
    bind_followed_path<T>(m, suffix);
    nb::class_<search>(m, ("MotionSearch" + suffix).c_str(), "The search for motions, one island.")
        .def(
            "__init__",
            [](search* self, const model<T>& scene, const motion_request& problem,
               const motion_search_settings& settings, std::uint64_t seed, std::uint32_t island) {
                require_sound(settings);
                new (self) search(problem_of(scene, problem), settings, seed, island);
            },
            nb::kw_only(), "scene"_a, "problem"_a, "settings"_a, "seed"_a, "island"_a)
        .def(
            "run", &run<T>, nb::kw_only(), "evaluations"_a, "seconds"_a, "until_first"_a, "stall"_a,
            "progress"_a.none(),
            "Goes on; 0 is no limit. `progress` is told the evaluations now and then, and stops the search with False.")
        .def(
            "add_instant",
            [](search& s, double at, double spread) {
                require(at >= 0 && at <= 1 && spread >= 0 && spread <= 1, "an instant out of range");
                s.turn([&] { s.search.add_instant(at, spread); });
            },
            "at"_a, "spread"_a, "Looks there from now on; motions that collide there are forgotten.")
        .def("judge", &judge<T>, "rows"_a, "interior"_a, "goal"_a, "What motions (rows, K n) are worth.")
        .def("blend_corners", &blend_corners<T>, "corners"_a, "goal"_a,
             "The motion along a path (m, n) from the start to a goal, as near to it as it takes to be free.")
        .def("shorten", &shorten<T>, "corners"_a, "goal"_a, nb::kw_only(), "shortcuts"_a, "seed"_a,
             "A path (m, n) without the points that it does not need, shortened by so many random shortcuts.")
        .def("with_interior", &with_interior<T>, "rows"_a, "interior"_a, "goal"_a, "wanted"_a,
             "The motions with another number of control points that are nearest to motions (rows, K n).")
        .def("base_along", &base_along<T>, "rows"_a, "interior"_a, "goal"_a, "nodes"_a, "ends_only"_a,
             "Position and attitude wxyz of the base at the nodes (rows, nodes + 1, 7), or at the last (rows, 1, 7).")
        .def("project", &project<T>, "rows"_a, "interior"_a, "goal"_a,
             "Motions (rows, K n) moved until their terminal constraints are met.")
        .def_prop_ro("best", &best_of<T>, nb::rv_policy::move)
        .def_prop_ro("fallback", &fallback_of<T>, nb::rv_policy::move,
                     "Of the motions that are not free, the one that is the least in collision.")
        .def_prop_ro("history", &history_of<T>, nb::rv_policy::move)
        .def_prop_ro("optimal", [](search& s) { return taken(s, [](motion_search<T>& of) { return of.optimal(); }); })
        .def_prop_ro("evaluations",
                     [](search& s) { return taken(s, [](motion_search<T>& of) { return of.evaluations(); }); })
        .def_prop_ro("configurations",
                     [](search& s) { return taken(s, [](motion_search<T>& of) { return of.configurations(); }); })
        .def_prop_ro("seconds", [](search& s) { return taken(s, [](motion_search<T>& of) { return of.seconds(); }); });
}

// Values of the spline's basis, (m, K + 2), for the tests.
inline out_array<double, 2> spline_values(in1<double> s, int interior, int derivative) {
    require(interior >= 0 && interior <= most_interior && derivative >= 0 && derivative <= 5, "out of range");
    std::vector<double> out;
    for (std::size_t i = 0; i < s.shape(0); ++i) {
        require(s(i) >= 0 && s(i) <= 1, "an instant out of range");
        const std::vector<double> row = spline_basis(s(i), interior, derivative);
        out.insert(out.end(), row.begin(), row.end());
    }
    return array_of<double, 2>(std::move(out), {s.shape(0), static_cast<std::size_t>(interior + 2)});
}

}  // namespace SPACEARM_NAMESPACE
