// The planner's search: the first free motion at once, then better ones for as long as it may go on.
//
// The straight motion to each goal comes first. Then it is a hybrid of three methods:
//   rrt_connect  two trees find a path with corners, which is shortened; a spline follows it (path_motions.hpp)
//   refine       a motion found is pulled towards the straight one and shaken, as long as that pays
//   swarm        particles are motions; they begin at the best ones known, or anywhere where none is known
// While no motion is known, trees and swarm take turns, which become longer. Then three compete: shorter versions of
// the best motion's path, other paths, and the swarm; what gained most for its work lately has the next turn. Where the
// base floats and its end is constrained, turns have a fixed order. docs/theory.md, "The search", has the reasons.
//
// A motion counts only when all instants, the fine ones too, are free. Numbers depend on (seed, island) and on how many
// motions are looked at, never on time or threads, unless a time limit ends the search.
#pragma once

#include <chrono>
#include <functional>

#include "search/method_credits.hpp"
#include "search/path_motions.hpp"
#include "search/path_shortening.hpp"
#include "search/search_settings.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> class motion_search {
  public:
    motion_search(motion_problem<T> problem, motion_search_settings settings, std::uint64_t seed, std::uint32_t island)
        : p_(std::move(problem)), s_(std::move(settings)), checker_(p_), trees_(checker_, s_.trees),
          motions_of_(checker_), of_trees_({seed, island, stream::rrt_connect}, {}),
          refining_({seed, island, stream::refining}, {}), seed_(seed), island_(island) {}
    motion_search(const motion_search&) = delete;  // the checker refers to the problem

    // Goes on until the budget is spent, or nothing can be better, or `go_on` says no; it is asked now and then.
    void run(const motion_budget& budget, const std::function<bool()>& go_on) {
        budget_ = budget;
        go_on_ = &go_on;
        begun_ = std::chrono::steady_clock::now();
        stopped_ = false;
        next_question_ = 0;
        first_evaluation_ = evaluations_;
        last_gain_ = evaluations_;
        if (!tried_straight_) straight();
        while (!over() && !optimal_) {
            ++turn_;
            if (best_.empty()) find_first();
            else improve();
        }
        spent_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
    }

    // A proof found a collision at s: that instant is looked at from now on, all others are made denser, and what
    // breaks at any of them is forgotten.
    void add_instant(double s, double spread) {
        checker_.add_instant(s, spread);
        optimal_ = false;
        std::vector<known> still_free;
        for (known& k : pool_) {
            if (checker_.finely_free(k.at)) still_free.push_back(std::move(k));
        }
        pool_ = std::move(still_free);
        std::erase_if(history_, [&](const motion_record<T>& r) { return !checker_.finely_free(r.found); });
        best_.clear();
        for (const known& k : pool_) {
            if (best_.empty() || k.fitness < best_.front().fitness) best_.assign(1, k);
        }
        for (const motion_record<T>& r : history_) {
            if (best_.empty() || r.fitness < best_.front().fitness) best_.assign(1, {r.fitness, r.found});
        }
        paths_.clear();
        tried_straight_ = false;
    }

    bool found() const { return !best_.empty(); }
    bool optimal() const { return optimal_; }
    const motion<T>& best() const { return best_.front().at; }
    T best_fitness() const { return best_.front().fitness; }
    T best_value() const { return best_.empty() ? infinity : best_fitness(); }
    const std::vector<motion_record<T>>& history() const { return history_; }
    // The best of those that are not free: the least violation.
    bool has_fallback() const { return fallback_violation_ < infinity; }
    const motion<T>& fallback() const { return fallback_; }
    T fallback_violation() const { return fallback_violation_; }
    std::int64_t evaluations() const { return evaluations_; }
    std::int64_t configurations() const { return checker_.configurations(); }
    double seconds() const { return spent_; }
    motion_checker<T>& checker() { return checker_; }

  private:
    static constexpr T infinity = std::numeric_limits<T>::infinity();
    struct known {
        T fitness;
        motion<T> at;
    };

    bool over() {
        if (stopped_) return true;
        if (budget_.until_first && !best_.empty()) return stopped_ = true;
        if (budget_.evaluations > 0 && evaluations_ - first_evaluation_ >= budget_.evaluations) return stopped_ = true;
        if (budget_.stall > 0 && evaluations_ - last_gain_ >= budget_.stall) return stopped_ = true;
        return late();
    }
    // Whether time is up, or somebody says stop: asked in every loop that may be long, for it changes no number.
    bool late() {
        if (stopped_) return true;
        if (++asked_ % hints_.looks_per_question != 0) return false;
        const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
        if (budget_.seconds > 0 && elapsed > budget_.seconds) return stopped_ = true;
        if (elapsed > next_question_) {
            next_question_ = elapsed + 0.04;
            if (!(*go_on_)()) return stopped_ = true;
        }
        return false;
    }

    // Many looks at a motion's end take as long as one at the whole of it, and are booked so.
    bool project_onto_ends(motion<T>& m, terminal_solver<T>* own = nullptr) {
        const bool met = checker_.project_onto_ends(m, own ? *own : checker_.solver(), [&] { return !late(); });
        evaluations_ += checker_.looks / looks_an_evaluation;
        checker_.looks %= looks_an_evaluation;
        return met;
    }
    static constexpr int looks_an_evaluation = 32;

    void note(const motion<T>& m, T fitness, const char* by) {
        if (!best_.empty() && !(fitness < best_.front().fitness)) return;
        if (best_.empty() || fitness < T(0.999) * last_noted_) {
            last_gain_ = evaluations_;
            last_noted_ = fitness;
        }
        best_.assign(1, {fitness, m});
        const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
        history_.push_back({spent_ + elapsed, evaluations_, fitness, by, m});
    }
    void note_fallback(const motion<T>& m, T violation) {
        if (violation < fallback_violation_) {
            fallback_violation_ = violation;
            fallback_ = m;
        }
    }
    void keep(const motion<T>& m, T fitness) {
        pool_.push_back({fitness, m});
        std::stable_sort(pool_.begin(), pool_.end(),
                         [](const known& a, const known& b) { return a.fitness < b.fitness; });
        if (pool_.size() > pool_size) pool_.resize(pool_size);
    }
    static constexpr std::size_t pool_size = 8;

    // ---- straight ---------------------------------------------------------------------------------------------------
    void straight() {
        tried_straight_ = true;
        int nearest = -1;
        T least = infinity;
        if (p_.base.free_end) {  // there already?
            const motion<T> m{0, 0, {}, p_.start};
            if (checker_.free(m)) {
                note(m, checker_.fitness(m), "straight");
                keep(m, best_fitness());
                optimal_ = p_.weight.only_length();
                return;
            }
        }
        for (int g = 0; g < p_.goal_count() && !(g > 0 && late()); ++g) {
            motion<T> m{0, g, {}};
            ++evaluations_;
            project_onto_ends(m);
            const T fitness = checker_.fitness(m), broken = checker_.violation(m, infinity);
            if (fitness < least) {
                least = fitness;
                nearest = g;
            }
            if (broken > T(0)) note_fallback(m, broken);
            else if (checker_.finely_free(m)) {
                note(m, fitness, "straight");
                keep(m, fitness);
            }
        }
        // Nothing is shorter than straight to the nearest goal; a motion that was known before may be another one.
        optimal_ = found() && best().goal == nearest && best_fitness() <= least && p_.weight.only_length()
                   && !p_.base.ends.any();
    }

    // ---- paths ------------------------------------------------------------------------------------------------------
    // The trees' next path, within so many samples.
    bool find_path(path<T>& found, int samples) {
        if (s_.patience == 0) return false;
        const bool met = trees_.grow(
            std::max(1, samples / hints_.tree_share), of_trees_,
            [&] {
                ++evaluations_;
                return !over() && (trees_until_ == 0 || checker_.configurations() < trees_until_);
            },
            [&] { return !late(); }, found);
        if (met) shortener_.prune(found, [&] { return !late(); });
        return met;
    }
    // While nothing is known: the trees, and now and then motions from all over the place. The turns become longer and
    // longer: neither waits long for the other, and in the end both have had their share of the work.
    void find_first() {
        path<T> found;
        if (!hints_.trees_find_motions || s_.patience == 0) {
            if (turn_ % 2 == 0) swarm_turn(false);
            else if (find_path(found, s_.patience)) follow(found);
            else if (!over()) swarm_turn(false);
            return;
        }
        trees_until_ = checker_.configurations() + trees_turn_;
        while (best_.empty() && !over() && checker_.configurations() < trees_until_) {
            if (find_path(found, std::numeric_limits<int>::max())) follow(found);
        }
        trees_until_ = 0;
        if (!best_.empty() || over()) return;
        take_swarm_turn(false, static_cast<std::int64_t>(s_.swarm_share * static_cast<double>(trees_turn_)));
        trees_turn_ = std::min(2 * trees_turn_, std::int64_t{1} << 40);
    }
    void take_swarm_turn(bool from_pool, std::int64_t configurations) {
        swarm_until_ = checker_.configurations() + configurations;
        swarm_turn(from_pool);
        swarm_until_ = 0;
    }

    // ---- better motions: what has paid lately has the next turn ----------------------------------------------------
    void improve() {
        if (p_.base.constrained()) {
            if (s_.swarm_every > 0 && turn_ % s_.swarm_every == 0) swarm_turn(true);
            else if (turn_ % 2 == 1) swarm_turn(false);  // as in find_first: elsewhere there may be better ones
            else another_path();
            return;
        }
        const int chosen = credits_.next([&](int i) { return possible(i); });
        const std::int64_t before = checker_.configurations();
        const double had = static_cast<double>(best_fitness());
        switch (chosen) {
            case shorter_path: shorten_a_path(); break;
            case other_path: another_path(); break;
            default: take_swarm_turn(true, std::int64_t{swarm_first} << std::min(credits_.turns(around_known), 30));
        }
        const double gain = (had - static_cast<double>(best_fitness())) / std::max(had, 1e-30);
        credits_.book(chosen, gain, static_cast<double>(checker_.configurations() - before));
    }
    bool possible(int i) const {
        if (i == around_known) return s_.swarm_every > 0 || s_.patience == 0;
        if (i == shorter_path) return !paths_.empty();
        return s_.patience > 0;
    }
    // The trees' next path is shortened, and followed if it is not much longer than the best motion.
    void another_path() {
        path<T> found;
        if (!find_path(found, s_.patience)) {
            if (!over() && p_.base.constrained()) swarm_turn(true);
            return;
        }
        if (p_.weight.only_length()) {
            for (const int tries : {s_.shortcuts / 4, s_.shortcuts}) {
                shorten(found, tries);
                if (p_.weight.length * found.length(p_.dofs()) > T(s_.detour) * best_fitness()) return;
            }
        }
        follow(found);
    }
    // The shortest path that became a motion is shortened further, and followed again.
    void shorten_a_path() {
        path<T> p = paths_.back();
        if (shorten(p, s_.shortcuts)) {
            shortener_.prune(p, [&] { return !late(); });
            paths_.back() = p;
            if (follow(p)) return;
        } else {
            paths_.clear();
        }
        if (!over() && !refined_) refine(best_.front());
    }
    bool shorten(path<T>& p, int tries) {
        return shortener_.shorten(p, tries, s_.shortcut_stall, refining_, [&] {
            ++evaluations_;
            return !over();
        });
    }
    // A motion along a path, and what can be made of it; false where there is none.
    bool follow(const path<T>& along_path) {
        motion<T> m;
        if (motion_along(along_path, m)) {
            const bool first = best_.empty();
            const T fitness = checker_.fitness(m);
            if (first || checker_.densely_free(m)) note(m, fitness, "rrt_connect");
            if (over()) return true;
            if (paths_.empty()) paths_.push_back(along_path);
            else if (along_path.length(p_.dofs()) < paths_.back().length(p_.dofs())) paths_.back() = along_path;
            // Refining pays with few control points; where there are many, the path is shortened first.
            refined_ = !first || m.interior <= few;
            if (refined_) refine({fitness, m});
            else keep(m, fitness);
            return true;
        }
        if (best_.empty() && ++unfit_ % unfit_paths == 0 && !over()) {  // the swarm may mend what is nearly free
            const int K = s_.interior[swarm_turns_ % s_.interior.size()];
            run_swarm(K, {motions_of_.nearest_to(along_path, K)});
        }
        return false;
    }
    static constexpr int few = 4;          // control points with which a motion is refined at once
    static constexpr int unfit_paths = 8;  // without a motion, after which the swarm begins at the last one
    // The spline with few control points that is nearest to the path; else the path with rounded corners; and where an
    // edge of the path was not free after all, splines with more control points, which leave it here and there.
    bool motion_along(const path<T>& along_path, motion<T>& m) {
        const bool blends = hints_.trees_find_motions;
        for (std::size_t i = 0; i < s_.ladder.size(); ++i) {
            if (i == 1 && blends && blend_corners(along_path, m)) return true;
            m = motions_of_.nearest_to(along_path, s_.ladder[i]);
            ++evaluations_;
            project_onto_ends(m);
            if (blends ? checker_.free(m) : free_or_noted(m)) return true;
            if (over()) return false;
        }
        return blends && s_.ladder.size() == 1 && blend_corners(along_path, m);
    }
    bool blend_corners(const path<T>& along_path, motion<T>& m) {
        blended_path<T> blended = motions_of_.blend_corners(along_path, [&] {
            ++evaluations_;
            return !over();
        });
        // If edges that were free are blocked again and again, they are looked at too coarsely.
        if (blended.outcome == blend_outcome::blocked && ++blocked_ % blocked_edges == 0)
            checker_.base().look_closer_at_edges();
        if (blended.outcome != blend_outcome::free) return false;
        m = std::move(blended.found);
        return true;
    }
    static constexpr int blocked_edges = 4;  // after which edges get twice as many instants
    bool free_or_noted(const motion<T>& m) {
        if (!best_.empty()) return checker_.free(m);
        const T broken = checker_.violation(m, infinity);
        if (broken > T(0)) note_fallback(m, broken);
        return broken <= T(0) && checker_.finely_free(m);
    }

    // ---- refine -----------------------------------------------------------------------------------------------------
    // One candidate after the other: some control points pulled towards the straight motion, most of them shaken too.
    // Both strengths follow success, as in an evolution strategy with one parent: they stay as they are
    // where one in 14 of the candidates with a better fitness is free.
    static constexpr T after_success = T(1.3), after_failure = T(0.98);
    static constexpr T first_pull = T(0.3), least_pull = T(0.003);    // as a share of the way
    static constexpr T least_shake = T(0.003), most_shake = T(0.6);   // [rad or m]
    static constexpr int simplified_every = 50, given_up_from = 150;  // candidates
    void refine(known now) {
        refined_ = true;
        T shake = T(s_.shake), pull = first_pull;
        const T worth_a_look = hints_.dense ? T(0.998) : T(1);
        known sure = now;
        motion<T> next;
        int failures = 0, undone = 0;
        for (int i = 1; failures <= s_.refine_stall && undone <= most_undone && !over(); ++i) {
            ++evaluations_;
            propose(now.at, shake, pull, next);
            ++failures;
            if (!project_onto_ends(next)) {
                shake = std::max(shake * after_failure, least_shake);
                continue;
            }
            const T fitness = checker_.fitness(next);
            if (fitness < now.fitness) {
                const bool better = checker_.free(next);
                const T factor = better ? after_success : after_failure;
                shake = std::clamp(shake * factor, least_shake, most_shake);
                pull = std::clamp(pull * factor, least_pull, T(1));
                if (better) {
                    std::swap(now.at, next);
                    now.fitness = fitness;
                    failures = 0;
                    if (fitness < worth_a_look * sure.fitness && !confirm(now, sure)) ++undone;
                }
            }
            if (i % simplified_every == 0) simplify(now);
            if (i > given_up_from && now.fitness > T(s_.give_up) * best_fitness()) break;
        }
        if (now.fitness < sure.fitness && !over()) confirm(now, sure);
        keep(sure.at, sure.fitness);
    }
    static constexpr int most_undone = 10;
    // Looks at a motion between its instants. If it is free there, it is noted; else the last one that was is taken up
    // again. Small improvements are looked at together: a dense look takes as long as several others.
    bool confirm(known& now, known& sure) {
        if (!checker_.densely_free(now.at)) {
            now = sure;
            return false;
        }
        sure = now;
        note(now.at, now.fitness, "refine");
        return true;
    }
    void propose(const motion<T>& m, T shake, T pull, motion<T>& out) {
        const int n = p_.dofs(), K = m.interior;
        out = m;
        if (K == 0) {  // the straight motion has nothing to shake: give it a control point
            out = motions_of_.with_interior(m, 1);
        }
        if (p_.base.free_end && out.end.empty()) out.end.assign(p_.end(m), p_.end(m) + n);
        const int all = out.interior + (p_.base.free_end ? 1 : 0);  // the end last
        const int only = refining_.uniform() < T(0.4) ? -1 : refining_.below(all);
        const T share = pull * refining_.uniform(), u = refining_.uniform();
        const T deviation = refining_.uniform() < T(0.8) ? shake * (T(0.1) + T(1.9) * u * u) : T(0);
        for (int k = 0; k < all; ++k) {
            if (only >= 0 && k != only) continue;
            for (int d = 0; d < n; ++d) {
                T& q = k < out.interior ? out.points[k * n + d] : out.end[d];
                q += share * (p_.straight(p_.end(m), k, out.interior, d) - q);
                if (deviation > T(0)) q += deviation * refining_.bell();
                q = std::clamp(q, p_.lower[d], p_.upper[d]);
            }
        }
    }
    // Fewer control points, if that costs next to nothing.
    void simplify(known& now) {
        for (int K : s_.ladder) {
            if (K >= now.at.interior) return;
            if (K < *std::min_element(s_.interior.begin(), s_.interior.end())) continue;
            motion<T> m = motions_of_.with_interior(now.at, K);
            ++evaluations_;
            if (!project_onto_ends(m)) continue;
            const T fitness = checker_.fitness(m);
            if (!(fitness < T(1.02) * now.fitness) || !checker_.free(m) || !checker_.densely_free(m)) continue;
            now = {fitness, m};
            note(m, fitness, "refine");
            return;
        }
    }

    // ---- swarm ------------------------------------------------------------------------------------------------------
    void swarm_turn(bool from_pool) {
        // While there is no motion, more and more control points: what a few cannot do more of them may.
        const int rounds = swarm_turns_ / static_cast<int>(s_.interior.size());
        const int K = s_.interior[swarm_turns_ % s_.interior.size()] + (best_.empty() ? std::min(rounds / 2, 4) : 0);
        std::vector<motion<T>> known_motions;
        if (from_pool) {
            for (const known& k : pool_) {
                if (k.at.goal == pool_.front().at.goal) known_motions.push_back(motions_of_.with_interior(k.at, K));
            }
        }
        run_swarm(K, known_motions);
    }
    // Particles around the known motions: each of these itself, then pulled and shaken copies. Without any around the
    // straight motion to any goal, more and more loosely.
    void run_swarm(int K, const std::vector<motion<T>>& known_motions) {
        const int particles = s_.swarm.particles;
        const int goal = known_motions.empty() ? refining_.below(p_.goal_count()) : known_motions.front().goal;
        swarm<T> particles_of = new_swarm(K);
        std::vector<std::vector<T>> rows;
        for (int i = 0; i < particles; ++i) rows.push_back(first_row(K, goal, known_motions, i, particles));
        // Their slopes serve from round to round.
        std::vector<terminal_solver<T>> solvers(p_.base.ends.any() ? particles : 0);
        std::vector<T> fitness(particles_of.stride()), violation(particles_of.stride());
        const bool none_known = best_.empty(), scouting = !none_known && known_motions.empty();
        known seen{infinity, {}};  // the best free motion of this swarm
        T nearest = infinity;      // the least violation
        int since = 0;             // rounds without improvement
        const int patience = p_.base.constrained() ? s_.swarm_stall : unmet_patience * s_.swarm_stall;
        while (!particles_of.spent() && since <= (seen.fitness < infinity ? s_.swarm_stall : patience)) {
            particles_of.ask();
            if (particles_of.round() == 0) particles_of.place_first(rows);
            const T before = seen.fitness;
            if (!judge_particles(particles_of, K, goal, solvers, fitness.data(), violation.data(), seen)) return;
            particles_of.tell(fitness.data(), violation.data());
            if ((none_known && !best_.empty()) || (scouting && seen.fitness < infinity)) break;
            since = seen.fitness < better_fitness * before ? 0 : since + 1;
            if (!(seen.fitness < infinity) && particles_of.best().violation < better_violation * nearest) {
                nearest = particles_of.best().violation;
                if (p_.base.constrained()) since = 0;
            }
        }
        if (none_known && !best_.empty()) refine(best_.front());
        else if (scouting && seen.fitness < infinity) refine(seen);
        else if (seen.fitness < infinity && particles_of.best().violation <= T(0)) {
            motion<T> m = motion_of(K, goal, particles_of.best_position());
            if (project_onto_ends(m)) keep(m, checker_.fitness(m));
        }
    }
    static constexpr int unmet_patience = 8;  // times as many rounds while no particle is free
    // What counts as an improvement in a round, as a share of what it was.
    static constexpr T better_fitness = T(0.9995), better_violation = T(0.98);
    // Particles within the joints' limits, with random numbers of their own.
    swarm<T> new_swarm(int K) {
        const int n = p_.dofs(), D = (p_.base.free_end ? K + 1 : K) * n;
        std::vector<T> lower(D), upper(D);
        for (int i = 0; i < D; ++i) {
            lower[i] = p_.lower[i % n];
            upper[i] = p_.upper[i % n];
        }
        return swarm<T>(s_.swarm, lower, upper, seed_, island_ * 65536u + static_cast<std::uint32_t>(swarm_turns_++));
    }
    // Judges the particles of a round, and keeps the best free one; false when the turn or the search is over.
    bool judge_particles(swarm<T>& particles_of, int K, int goal, std::vector<terminal_solver<T>>& solvers, T* fitness,
                         T* violation, known& seen) {
        const int stride = particles_of.stride();
        const T* x = particles_of.positions();
        std::vector<T> row(static_cast<std::size_t>(p_.base.free_end ? K + 1 : K) * p_.dofs());
        for (int i = 0; i < particles_of.active(); ++i) {
            if (over() || (swarm_until_ > 0 && checker_.configurations() >= swarm_until_)) return false;
            for (std::size_t d = 0; d < row.size(); ++d) row[d] = x[d * static_cast<std::size_t>(stride) + i];
            motion<T> m = motion_of(K, goal, row);
            judge(m, particles_of.round() > 0 ? particles_of.personal_best(i) : merit<T>{infinity, infinity},
                  fitness[i], violation[i], p_.base.ends.any() ? &solvers[i] : nullptr);
            if (p_.base.ends.any()) {  // from now on the particle is there
                std::copy(m.points.begin(), m.points.end(), row.begin());
                std::copy(m.end.begin(), m.end.end(), row.begin() + static_cast<std::ptrdiff_t>(m.points.size()));
                particles_of.put(i, row.data());
            }
            if (violation[i] <= T(0) && fitness[i] < seen.fitness) seen = {fitness[i], m};
        }
        return true;
    }
    // A particle's numbers: the interior control points, then the end where it is free.
    motion<T> motion_of(int K, int goal, const std::vector<T>& row) const {
        const auto end = row.begin() + static_cast<std::ptrdiff_t>(K) * p_.dofs();
        return {K, goal, std::vector<T>(row.begin(), end), std::vector<T>(end, row.end())};
    }
    // What the swarm needs to know of a particle: its merit, or only that it is no better than the particle's own best.
    // Where ends are asked for, it is moved to the motion nearest to it that meets them.
    void judge(motion<T>& m, const merit<T>& own, T& fitness, T& violation, terminal_solver<T>* solver) {
        ++evaluations_;
        const bool met = project_onto_ends(m, solver), has_been_free = own.violation <= T(0);
        fitness = checker_.fitness(m);
        violation = infinity;
        if (has_been_free && !met) return;
        if (has_been_free && !(fitness < own.fitness)) return;
        const T broken = checker_.violation(m, has_been_free ? T(0) : own.violation);
        if (broken > T(0)) {
            if (!has_been_free && broken <= own.violation) {
                violation = broken;
                note_fallback(m, broken);
            }
            return;
        }
        if (checker_.finely_free(m) && (!(fitness < best_value()) || checker_.densely_free(m))) {
            violation = 0;
            note(m, fitness, "swarm");
        } else if (!has_been_free) {
            violation = barely;  // worse than free, better than what is broken at the coarse instants
        }
    }
    static constexpr T barely = T(1e-6);

    std::vector<T> first_row(int K, int goal, const std::vector<motion<T>>& known_motions, int i, int particles) {
        const int n = p_.dofs(), D = (p_.base.free_end ? K + 1 : K) * n;
        std::vector<T> row(D);
        const int known_ones = static_cast<int>(known_motions.size());
        const bool as_it_is = i < known_ones;
        const T spread = as_it_is     ? T(0)
                         : known_ones ? T(s_.swarm_spread) * refining_.uniform()
                                      : T(0.5) * (T(0.2) + T(1.8) * T(i) / T(particles)) * (T(1) + T(swarm_turns_ % 3));
        const T pull = as_it_is ? T(0) : T(0.5) * refining_.uniform();
        for (int k = 0; k < D; ++k) {
            const motion<T>* from = known_ones ? &known_motions[i % known_ones] : nullptr;
            const T* end = from ? p_.end(*from) : p_.goal(goal);
            const T line = p_.straight(end, k / n, K, k % n);
            T q = !from ? line : k < K * n ? from->points[k] : end[k - K * n];
            if (!as_it_is) q += pull * (line - q) + spread * refining_.bell();
            row[k] = std::clamp(q, p_.lower[k % n], p_.upper[k % n]);
        }
        return row;
    }

    motion_problem<T> p_;
    motion_search_settings s_;
    motion_checker<T> checker_;
    const search_hints hints_ = checker_.base().hints();
    rrt_connect<T> trees_;
    path_shortener<T> shortener_{trees_, p_.dofs()};
    path_motions<T> motions_of_;
    search_sequence<T> of_trees_, refining_;
    std::uint64_t seed_;
    std::uint32_t island_;
    motion_budget budget_;
    const std::function<bool()>* go_on_ = nullptr;
    std::chrono::steady_clock::time_point begun_;
    bool stopped_ = false, tried_straight_ = false, optimal_ = false, refined_ = true;
    double spent_ = 0, next_question_ = 0;
    std::int64_t evaluations_ = 0, first_evaluation_ = 0, last_gain_ = 0;
    std::uint64_t asked_ = 0;
    int turn_ = 0, swarm_turns_ = 0, unfit_ = 0, blocked_ = 0;
    // [configurations] how long the trees' turn is while nothing is known; where turns end that do, 0: nowhere.
    std::int64_t trees_turn_ = s_.first_turn, trees_until_ = 0, swarm_until_ = 0;
    enum { shorter_path, other_path, around_known, method_count };
    static constexpr int swarm_first = 1 << 14;  // configurations of the first turn; then twice as many each time
    method_credits<method_count> credits_;
    std::vector<path<T>> paths_;  // the shortest that became a motion and may be shortened yet, or none
    T last_noted_ = infinity, fallback_violation_ = infinity;
    std::vector<known> best_, pool_;  // best_ holds one motion or none
    motion<T> fallback_;
    std::vector<motion_record<T>> history_;
};

}  // namespace SPACEARM_NAMESPACE
