// Python's arrays and swarms: step by step, and whole runs on the objectives that the kernel knows.
#pragma once

#include "python/bind_world.hpp"
#include "swarm/objectives.hpp"
#include "swarm/trials.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> struct box {
    std::vector<T> lower, upper;
};
template <class T> box<T> box_of(const in1<double>& lower, const in1<double>& upper) {
    require(lower.shape(0) == upper.shape(0) && lower.shape(0) >= 1 && lower.shape(0) <= (1u << 24),
            "bounds of different lengths, or of none");
    box<T> out{std::vector<T>(lower.data(), lower.data() + lower.shape(0)),
               std::vector<T>(upper.data(), upper.data() + upper.shape(0))};
    for (std::size_t d = 0; d < out.lower.size(); ++d) {
        require(out.lower[d] <= out.upper[d] && within(out.upper[d] - out.lower[d], std::numeric_limits<T>::max()),
                "bounds that are no range");
    }
    return out;
}

template <class T> std::vector<std::vector<T>> rows_of(const in2<T>& rows, int dims) {
    require(rows.shape(1) == static_cast<std::size_t>(dims), "wrong number of dimensions");
    std::vector<std::vector<T>> out(rows.shape(0));
    for (std::size_t i = 0; i < out.size(); ++i) {
        for (std::size_t d = 0; d < rows.shape(1); ++d) out[i].push_back(rows(i, d));
    }
    return out;
}

// ---- step by step ---------------------------------------------------------------------------------------------------
// Particles as rows.
template <class T> out_array<T, 2> position_rows(const swarm<T>& s) {
    const std::size_t n = s.active(), dims = s.dims();
    std::vector<T> out(n * dims);
    for (std::size_t d = 0; d < dims; ++d) {
        const T* from = s.positions() + d * s.stride();
        for (std::size_t i = 0; i < n; ++i) out[i * dims + d] = from[i];
    }
    return array_of<T, 2>(std::move(out), {n, dims});
}

template <class T> nb::dict get_state(swarm<T>& s) {
    nb::dict out;
    s.visit_state([&](const char* name, std::vector<T>& values) { out[name] = row_of(values); });
    out["counters"] = row_of(s.counters());
    return out;
}

template <class T> void set_state(swarm<T>& s, nb::dict state) {
    constexpr const char* other = "a checkpoint of another swarm";
    in1<std::int64_t> counters;
    const nb::object counters_given = state["counters"];  // a missing key raises here
    require(nb::try_cast(counters_given, counters), other);
    const std::vector<std::int64_t> counted = vector_of(counters);
    require(s.fits(counted), other);
    // All is checked before anything is changed.
    std::vector<std::vector<T>> saved;
    s.visit_state([&](const char* name, std::vector<T>& values) {
        in1<T> array;
        const nb::object given = state[name];
        require(nb::try_cast(given, array), other);
        const std::string key = name;
        const std::size_t size = array.shape(0), dims = static_cast<std::size_t>(s.dims());
        if (key == "archive") require(size % dims == 0, other);
        else if (key == "gain" || key == "drawn_factor" || key == "drawn_crossover")
            require(s.fits_candidates(counted, size), other);
        else require(size == values.size(), other);
        saved.push_back(vector_of(array));
    });
    std::size_t next = 0;
    s.visit_state([&](const char*, std::vector<T>& values) { values = saved[next++]; });
    s.restore_counters(counted);
}

template <class T> void bind_steps(nb::module_& m, const char* name) {
    nb::class_<swarm<T>>(m, name, "A particle swarm: ask, then tell, round after round.")
        .def(
            "__init__",
            [](swarm<T>* self, const swarm_settings& settings, in1<double> lower, in1<double> upper, std::uint64_t seed,
               std::uint32_t trial) {
                require_sound(settings);
                box<T> bounds = box_of<T>(lower, upper);
                new (self) swarm<T>(settings, std::move(bounds.lower), std::move(bounds.upper), seed, trial);
            },
            "settings"_a, "lower"_a, "upper"_a, "seed"_a, "trial"_a)
        .def("ask", [](swarm<T>& s) { s.ask(); })
        .def("positions", &position_rows<T>, "(active, dims) the positions asked for.")
        .def(
            "place_first", [](swarm<T>& s, in2<T> rows) { s.place_first(rows_of<T>(rows, s.dims())); }, "rows"_a)
        .def(
            "tell",
            [](swarm<T>& s, in1<T> fitness, in1<T> violation) {
                require(s.asked(), "told without having asked");
                require(fitness.shape(0) == static_cast<std::size_t>(s.active())
                            && violation.shape(0) == fitness.shape(0),
                        "wrong number of values");
                s.tell(fitness.data(), violation.data());
            },
            "fitness"_a, "violation"_a)
        .def_prop_ro("round", &swarm<T>::round)
        .def_prop_ro("active", &swarm<T>::active)
        .def_prop_ro("spent", &swarm<T>::spent)
        .def_prop_ro("evaluations", &swarm<T>::evaluations)
        .def_prop_ro("best_fitness", [](const swarm<T>& s) { return s.best().fitness; })
        .def_prop_ro("best_violation", [](const swarm<T>& s) { return s.best().violation; })
        .def_prop_ro(
            "best_position", [](const swarm<T>& s) { return row_of(s.best_position()); }, nb::rv_policy::move)
        .def_prop_ro("failed_evaluations", &swarm<T>::failed_evaluations)
        .def("state", &get_state<T>,
             nb::sig("def state(self) -> dict[str, numpy.typing.NDArray[numpy.float64 | numpy.float32 | numpy.int64]]"),
             "All that a later round depends on, by name.")
        .def("restore", &set_state<T>, "state"_a,
             nb::sig("def restore(self, state: dict[str, numpy.typing.NDArray[numpy.float64 | numpy.float32 | "
                     "numpy.int64]]) "
                     "-> None"));
}

// ---- whole runs -----------------------------------------------------------------------------------------------------
template <class T, class Objective>
std::pair<out_array<T, 1>, out_array<T, 1>> evaluate(const Objective& objective, in2<T> x) {
    require(static_cast<int>(x.shape(1)) == objective.dims(), "wrong number of dimensions");
    const std::size_t rows = x.shape(0);
    std::vector<T> f(rows), c(rows);
    auto w = objective.make_workspace();
    {
        nb::gil_scoped_release free;
        for_packs<T>(x, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            pack<T> fitness, violation;
            objective(packs, w, fitness, violation);
            store_lanes(fitness, &f[first], filled);
            store_lanes(violation, &c[first], filled);
        });
    }
    return {row_of(std::move(f)), row_of(std::move(c))};
}

template <class T> out_array<T, 2> paper_terms(const paper_objective<T>& objective, in2<T> q) {
    require(static_cast<int>(q.shape(1)) == objective.dims(), "wrong number of dimensions");
    const std::size_t rows = q.shape(0);
    std::vector<T> out(rows * 3);
    auto w = objective.make_workspace();
    {
        nb::gil_scoped_release free;
        for_packs<T>(q, [&](std::size_t first, std::size_t filled, const pack<T>* packs) {
            pack<T> fitness, violation, terms[3];
            objective(packs, w, fitness, violation, terms);
            for (int k = 0; k < 3; ++k) store_lanes(terms[k], &out[first * 3 + k], filled, 3);
        });
    }
    return array_of<T, 2>(std::move(out), {rows, 3});
}

// What a call without the GIL tells Python now and then, and whether it is to go on.
class progress_teller {
  public:
    explicit progress_teller(progress_function progress) : progress_(std::move(progress)) {}
    bool operator()(std::uint64_t done) {
        nb::gil_scoped_acquire hold;
        if (interrupted) return false;
        if (PyErr_CheckSignals() != 0) {
            interrupted = true;
            return false;
        }
        if (!progress_) return true;
        const nb::object answer = (*progress_)(done);
        if (answer.is_none()) return true;
        if (!PyBool_Check(answer.ptr())) throw nb::type_error("progress answers with None, True or False");
        return answer.is(nb::bool_(true));
    }
    bool interrupted = false;

  private:
    progress_function progress_;
};

template <class T, class Objective>
std::vector<trial_result<T>> search(const Objective& objective, in1<double> lower, in1<double> upper,
                                    const swarm_settings& settings, std::uint64_t seed, std::uint32_t first_trial,
                                    int trials, int threads, bool keep_positions, bool stop_when_feasible,
                                    double seconds, std::optional<in2<T>> initial, progress_function progress) {
    require_sound(settings);
    require(static_cast<int>(lower.shape(0)) == objective.dims(), "wrong number of dimensions");
    require(trials >= 0 && trials <= 100'000'000 && seconds >= 0, "a number of trials or seconds out of range");
    const search_limits limits{stop_when_feasible, seconds};
    progress_teller teller(std::move(progress));
    const progress_callback tell_caller = [&](std::uint64_t done) { return teller(done); };
    const box<T> bounds = box_of<T>(lower, upper);
    const auto start_swarm = [&](int trial) {
        return swarm<T>(settings, bounds.lower, bounds.upper, seed, first_trial + static_cast<std::uint32_t>(trial));
    };
    std::vector<std::vector<T>> first_rows;
    if (initial) first_rows = rows_of<T>(*initial, objective.dims());
    std::vector<trial_result<T>> results;
    {
        nb::gil_scoped_release free;
        results =
            run_trials<T>(objective, start_swarm, trials, limits, keep_positions, threads, tell_caller, first_rows);
    }
    if (teller.interrupted) throw nb::python_error();
    return results;
}

template <class T> void bind_result(nb::module_& m, const char* name) {
    using result = trial_result<T>;
    nb::class_<result>(m, name, "What one trial of a swarm came to; histories have one entry a round.")
        .def_prop_ro("fitness", [](const result& r) { return r.best.fitness; })
        .def_prop_ro("violation", [](const result& r) { return r.best.violation; })
        .def_ro("rounds", &result::rounds)
        .def_ro("evaluations", &result::evaluations)
        .def_ro("first_feasible_round", &result::first_feasible_round, "-1: none was feasible.")
        .def_prop_ro(
            "position", [](const result& r) { return row_of(r.position); }, nb::rv_policy::move)
        .def_prop_ro(
            "fitness_history", [](const result& r) { return row_of(r.fitness); }, nb::rv_policy::move)
        .def_prop_ro(
            "violation_history", [](const result& r) { return row_of(r.violation); }, nb::rv_policy::move)
        .def_prop_ro(
            "evaluation_history", [](const result& r) { return row_of(r.spent); }, nb::rv_policy::move)
        .def_prop_ro(
            "position_history",
            [](const result& r) {
                const std::size_t rows = static_cast<std::size_t>(r.rounds), dims = r.position.size();
                std::vector<T> all = r.positions;
                return array_of<T, 2>(std::move(all), {all.empty() ? 0 : rows, dims});
            },
            nb::rv_policy::move, "(rounds, dims), or (0, dims) if they were not kept.");
}

template <class T, class Objective> void bind_runs(nb::class_<Objective>& c) {
    c.def("evaluate", &evaluate<T, Objective>, "x"_a, "Fitness and violation (rows,) of rows of positions.")
        .def("search", &search<T, Objective>, nb::kw_only(), "lower"_a, "upper"_a, "settings"_a, "seed"_a,
             "first_trial"_a, "trials"_a, "threads"_a, "keep_positions"_a, "stop_when_feasible"_a, "seconds"_a,
             "initial"_a.none(), "progress"_a.none(),
             "Independent trials of a swarm, spread over threads; `progress` is told the rounds done, and says whether "
             "to go on.");
}

template <class T> void bind_objectives(nb::module_& m, const char* paper_name, const char* reach_name) {
    using paper = paper_objective<T>;
    using reach = reach_objective<T>;
    nb::class_<paper> p(m, paper_name, "The paper's fitness and constraints of one configuration.");
    p.def(
        "__init__",
        [](paper* self, const model<T>& scene, in_ints centers, int tip, in_vector goal, in_vector weights,
           bool must_reach, double tolerance) {
            const int points = static_cast<int>(scene.points.size());
            require(tip >= 0 && tip < points, "the tip is no point");
            for (std::size_t i = 0; i < centers.shape(0); ++i)
                require(centers(i) >= 0 && centers(i) < points, "a centre is no point");
            paper o{};
            o.scene = scene;
            o.tip = tip;
            double rest = 0;
            for (std::size_t i = 0; i < centers.shape(0); ++i) {
                const point<T>& at = scene.points[centers(i)];
                if (at.joint >= 0) {
                    o.centers.push_back(centers(i));
                    continue;
                }
                for (const sphere<T>& s : scene.spheres) {
                    double squared = 0;
                    for (int k = 0; k < 3; ++k)
                        squared += (double(s.center[k]) - at.local[k]) * (double(s.center[k]) - at.local[k]);
                    rest += std::sqrt(squared);
                }
            }
            o.f1_at_rest = static_cast<T>(rest);
            for (int k = 0; k < 3; ++k) {
                o.goal[k] = static_cast<T>(goal(k));
                o.weight[k] = static_cast<T>(weights(k));
            }
            o.must_reach = must_reach;
            o.tolerance = static_cast<T>(tolerance);
            new (self) paper(std::move(o));
        },
        nb::kw_only(), "scene"_a, "centers"_a, "tip"_a, "goal"_a, "weights"_a, "must_reach"_a, "tolerance"_a);
    p.def("terms", &paper_terms<T>, "q"_a, "f1, f2 and f3 (rows, 3).");
    bind_runs<T>(p);

    nb::class_<reach> r(m, reach_name, "Configurations that bring points of the robot to given places.");
    r.def(
        "__init__",
        [](reach* self, const model<T>& scene, in_ints points, in_places targets, in1<double> tolerances, double margin,
           in1<double> home) {
            const std::size_t count = points.shape(0);
            require(count >= 1 && targets.shape(0) == count && tolerances.shape(0) == count,
                    "the objective's arrays do not fit");
            require(home.shape(0) == static_cast<std::size_t>(scene.robot.dofs), "home has another length");
            reach o{};
            o.scene = scene;
            for (std::size_t i = 0; i < count; ++i) {
                require(points(i) >= 0 && points(i) < static_cast<int>(scene.points.size()),
                        "a target's point is none");
                typename reach::target to{points(i), {}, static_cast<T>(tolerances(i))};
                for (int k = 0; k < 3; ++k) to.position[k] = static_cast<T>(targets(i, k));
                o.targets.push_back(to);
            }
            o.margin = static_cast<T>(margin);
            o.home.assign(home.data(), home.data() + home.shape(0));
            new (self) reach(std::move(o));
        },
        nb::kw_only(), "scene"_a, "points"_a, "targets"_a, "tolerances"_a, "margin"_a, "home"_a);
    bind_runs<T>(r);
}

// ---- settings -------------------------------------------------------------------------------------------------------
inline void bind_swarm_settings(nb::module_& m) {
    nb::enum_<swarm_variant>(m, "SwarmVariant")
        .value("pso", swarm_variant::pso)
        .value("symbiotic", swarm_variant::symbiotic)
        .value("cooperative", swarm_variant::cooperative)
        .value("evolving", swarm_variant::evolving);
    nb::enum_<bounds_rule>(m, "BoundsRule")
        .value("absorb", bounds_rule::absorb)
        .value("reflect", bounds_rule::reflect)
        .value("periodic", bounds_rule::periodic);
    nb::enum_<constraint_rule>(m, "ConstraintRule")
        .value("feasible_first", constraint_rule::feasible_first)
        .value("penalty", constraint_rule::penalty);
    using s = swarm_settings;
    nb::class_<s>(m, "SwarmSettings", "Settings of a swarm, all with defaults; swarm_settings.hpp says what each is.")
        .def(nb::init<>())
        .def_rw("variant", &s::variant)
        .def_rw("bounds", &s::bounds)
        .def_rw("constraints", &s::constraints)
        .def_rw("particles", &s::particles)
        .def_rw("evaluations", &s::evaluations)
        .def_rw("inertia_start", &s::inertia_start)
        .def_rw("inertia_end", &s::inertia_end)
        .def_rw("cognitive", &s::cognitive)
        .def_rw("social", &s::social)
        .def_rw("cooperation", &s::cooperation)
        .def_rw("velocity_clamp", &s::velocity_clamp)
        .def_rw("start_velocity", &s::start_velocity)
        .def_rw("ring", &s::ring)
        .def_rw("penalty_start", &s::penalty_start)
        .def_rw("penalty_end", &s::penalty_end)
        .def_rw("penalty_rise", &s::penalty_rise)
        .def_rw("tolerance_share", &s::tolerance_share)
        .def_rw("tolerance_until", &s::tolerance_until)
        .def_rw("tolerance_power", &s::tolerance_power)
        .def_rw("evolving_share", &s::evolving_share)
        .def_rw("elite_share", &s::elite_share)
        .def_rw("memory", &s::memory)
        .def_rw("shrink_to", &s::shrink_to)
        .def(
            "check", [](const s& given) { require_sound(given); }, "Raises ValueError where a number is out of range.");
}

}  // namespace SPACEARM_NAMESPACE
