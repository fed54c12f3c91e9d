// Python's arrays and inverse kinematics.
#pragma once

#include <memory>

#include "python/bind_search.hpp"
#include "search/inverse_kinematics.hpp"

namespace SPACEARM_NAMESPACE {

// A search for goal configurations, and whose turn it is. Python's memory is not aligned as packs are.
template <class T> struct shared_goal_search {
    std::unique_ptr<goal_search<T>> own;
    goal_search<T>& search;
    one_at_a_time turn;
    shared_goal_search(const model<T>& scene, const terminal_constraints& goal, goal_search_settings settings)
        : own(std::make_unique<goal_search<T>>(scene, goal, std::move(settings))), search(*own) {}
};

inline constexpr int most_guesses = 1 << 24;

inline std::vector<row> rows_from(const in2c<double>& q, std::size_t dofs) {
    require(q.shape(1) == dofs, "wrong number of dimensions");
    require(std::all_of(q.data(), q.data() + q.size(), [](double x) { return within(x, widest); }),
            "a number that is none, or too large");
    std::vector<row> out;
    for (std::size_t i = 0; i < q.shape(0); ++i) out.emplace_back(q.data() + i * dofs, q.data() + (i + 1) * dofs);
    return out;
}
inline out_array<double, 2> array_of_rows(const std::vector<row>& rows, std::size_t dofs) {
    std::vector<double> out;
    out.reserve(rows.size() * dofs);
    for (const row& one : rows) out.insert(out.end(), one.begin(), one.end());
    return array_of<double, 2>(std::move(out), {rows.size(), dofs});
}

// What a search does when it is its turn, as an array of rows.
template <class T, class Work> out_array<double, 2> rows_of_turn(shared_goal_search<T>& s, Work&& work) {
    std::vector<row> rows;
    s.turn([&] { rows = work(s.search); });
    return array_of_rows(rows, s.search.dofs());
}

template <class T, class Work> int number_of_turn(shared_goal_search<T>& s, Work&& work) {
    int out = 0;
    s.turn([&] { out = work(s.search); });
    return out;
}

template <class T> void bind_goal_search(nb::module_& m, const std::string& suffix) {
    using shared = shared_goal_search<T>;
    nb::class_<shared>(m, ("GoalSearch" + suffix).c_str(),
                       "Free configurations that bring a frame to its goal, from many guesses side by side.")
        .def(
            "__init__",
            [](shared* self, const model<T>& scene, const terminal_constraints& goal, in1<double> start,
               in1<double> lower, in1<double> upper, in_bools whole_turns, double margin, std::uint64_t seed) {
                goal_search_settings s{vector_of(start), vector_of(lower), vector_of(upper), {}, margin, seed};
                s.whole_turns.assign(whole_turns.data(), whole_turns.data() + whole_turns.shape(0));
                new (self) shared(scene, goal, std::move(s));
            },
            nb::kw_only(), nb::keep_alive<1, 2>(), "scene"_a, "goal"_a, "start"_a, "lower"_a, "upper"_a,
            "whole_turns"_a, "margin"_a, "seed"_a)
        .def(
            "look",
            [](shared& s, int guesses) {
                s.turn([&] {
                    require(guesses >= 0 && guesses <= most_guesses - s.search.begun(),
                            "a number of guesses out of range");
                    signal_listener signals;
                    s.search.look(guesses, [&] { signals.ask(); });
                });
            },
            "guesses"_a, "Goes on with so many guesses more; the first is the start.")
        .def_prop_ro(
            "begun", [](shared& s) { return number_of_turn(s, [](auto& of) { return of.begun(); }); }, "Guesses.")
        .def_prop_ro(
            "reached", [](shared& s) { return number_of_turn(s, [](auto& of) { return of.reached(); }); },
            "How many of them led to the goal.")
        .def_prop_ro(
            "in_collision", [](shared& s) { return number_of_turn(s, [](auto& of) { return of.in_collision(); }); },
            "How many of those are in collision.")
        .def(
            "differing",
            [](shared& s, int most) { return rows_of_turn(s, [&](auto& of) { return of.differing(most); }); }, "most"_a,
            "(g, n) that have the clearance asked for, spread wide, nearest to the start first.")
        .def(
            "lacking", [](shared& s, int most) { return rows_of_turn(s, [&](auto& of) { return of.lacking(most); }); },
            "most"_a, "(g, n) that lack some of the clearance asked for, those that lack least first.")
        .def(
            "missed", [](shared& s, int most) { return rows_of_turn(s, [&](auto& of) { return of.missed(most); }); },
            "most"_a, "(b, n) where guesses ended that missed the goal, the nearest to it first.")
        .def(
            "pulled",
            [](shared& s, in2c<double> q, int most, bool pull, bool at_centre) {
                const std::vector<row> rows = rows_from(q, s.search.dofs());
                return rows_of_turn(s, [&](auto& of) { return of.pulled(rows, most, pull, at_centre); });
            },
            "q"_a, "most"_a, nb::kw_only(), "pull"_a, "at_centre"_a,
            "(g, n) of configurations at the goal, and with `pull` of what they become when pulled towards the start.")
        .def(
            "with_turns",
            [](shared& s, in2c<double> q, int most) {
                std::vector<row> rows = rows_from(q, s.search.dofs());
                return rows_of_turn(s, [&](auto& of) { return of.with_turns(std::move(rows), most); });
            },
            "q"_a, "most"_a, "(g, n) configurations, and while there are fewer those a whole turn of a joint away.");
    m.def(("polished" + suffix).c_str(),
          [](const model<T>& scene, const terminal_constraints& goal, in2c<double> q, in1<double> lower,
             in1<double> upper, int rounds) {
              const std::size_t dofs = scene.robot.dofs;
              require(lower.shape(0) == dofs && upper.shape(0) == dofs, "bounds of another length");
              require(rounds >= 0 && rounds <= 10000, "a number of rounds out of range");
              std::vector<row> rows = rows_from(q, dofs);
              const row low = vector_of(lower), high = vector_of(upper);
              {
                  nb::gil_scoped_release free;
                  rows = polished(scene.robot, goal, std::move(rows), low, high, rounds);
              }
              return array_of_rows(rows, dofs);
          },
          "scene"_a, "goal"_a, "q"_a, "lower"_a, "upper"_a, "rounds"_a,
          "(b, n) brought to the goal's centre by damped least squares, or as near to it as bounds and arm allow.");
}

}  // namespace SPACEARM_NAMESPACE
