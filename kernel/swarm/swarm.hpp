// The particle swarm: positions are asked for, their fitness and violation are told, round after round.
//
// One engine serves every caller: the native search fills the packs with its own objective, a Python function is asked
// through the same two steps. Particles lie side by side in memory, one row a dimension, so a step works on packs.
//
//   PSO          eq. (13), inertia weight constant or falling (eq. (14)), global best or a ring of neighbours
//   symbiotic    IPSO variant M: two slave populations, a master that follows its own and the slaves' best
//   cooperative  IPSO variant S: two searching populations, a third driven by their velocities
//   evolving     a third population that recombines personal bests instead of moving by velocity (evolution.hpp)
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "swarm/evolution.hpp"
#include "swarm/ring.hpp"
#include "swarm/swarm_settings.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> class swarm {
  public:
    static constexpr int W = lanes_of<T>;
    static constexpr T infinity = std::numeric_limits<T>::infinity();

    swarm(const swarm_settings& settings, std::vector<T> lower, std::vector<T> upper, std::uint64_t seed,
          std::uint32_t trial)
        : settings_(settings), dims_(static_cast<int>(lower.size())), lower_(std::move(lower)),
          upper_(std::move(upper)), seed_(seed), trial_(trial), evolver_(settings.memory) {
        const int n = settings_.particles;
        stride_ = (n + word_lanes - 1) / word_lanes * word_lanes;
        split_populations();
        const std::size_t all = static_cast<std::size_t>(dims_) * stride_;
        x_.assign(all, T(0));
        v_.assign(all, T(0));
        px_.assign(all, T(0));
        social_.assign(all, T(0));
        for (std::vector<T>* values :
             {&fitness_, &violation_, &best_fitness_, &best_violation_, &merit_fitness_, &merit_violation_}) {
            values->assign(stride_, infinity);
        }
        guide_.assign(stride_, 0);
        best_x_.assign(dims_, T(0));
        if (settings_.variant == swarm_variant::symbiotic) {
            social2_.assign(all, T(0));
            weight1_.assign(stride_, T(settings_.social));
            weight2_.assign(stride_, T(0));
        }
        if (settings_.variant == swarm_variant::cooperative) carried_.assign(all, T(0));
    }

    int active() const { return first_[3]; }  // particles asked for in this round; falls if population 3 shrinks
    int dims() const { return dims_; }
    int stride() const { return stride_; }
    int round() const { return round_; }
    std::int64_t evaluations() const { return used_; }
    bool spent() const { return used_ + active() > settings_.evaluations; }
    const T* positions() const { return x_.data(); }  // row d, particle i: positions()[d * stride() + i]
    merit<T> best() const { return best_; }
    merit<T> personal_best(int i) const { return {best_violation_[i], best_fitness_[i]}; }
    const std::vector<T>& best_position() const { return best_x_; }
    std::int64_t failed_evaluations() const { return failed_; }

    // The next positions, in place. Every ask is followed by a tell.
    void ask() {
        if (round_ == 0) start();
        else step();
        asked_ = true;
    }
    bool asked() const { return asked_; }

    // Known good positions, in place of the first random ones.
    void place_first(const std::vector<std::vector<T>>& rows) {
        const int n = static_cast<int>(std::min<std::size_t>(rows.size(), settings_.particles));
        for (int i = 0; i < n; ++i) put(i, rows[i].data());
    }
    void put(int i, const T* row) {
        for (int d = 0; d < dims_; ++d) x_[at(d, i)] = row[d];
    }  // before it is told

    // Fitness and violation of the positions asked for. A NaN counts as the worst there is.
    void tell(const T* fitness, const T* violation) {
        const int n = active();
        std::copy(fitness, fitness + n, fitness_.begin());
        std::copy(violation, violation + n, violation_.begin());
        std::fill(fitness_.begin() + n, fitness_.end(), infinity);
        std::fill(violation_.begin() + n, violation_.end(), infinity);
        sort_out_failures();
        used_ += n;
        if (round_ == 0) start_tolerance();
        apply_schedule();
        update_global_best();
        update_personal_bests();
        find_leaders();
        if (settings_.variant == swarm_variant::evolving && settings_.shrink_to > 0) shrink();
        if (round_ < most_rounds) ++round_;
        asked_ = false;
    }

    // ---- checkpoints: everything that a later round depends on ------------------------------------------------------
    template <class Visitor> void visit_state(Visitor&& visit) {
        visit("position", x_);
        visit("velocity", v_);
        visit("personal_best", px_);
        visit("social", social_);
        visit("fitness", fitness_);
        visit("violation", violation_);
        visit("best_fitness", best_fitness_);
        visit("best_violation", best_violation_);
        visit("best_position", best_x_);
        visit("archive", evolver_.archive);
        visit("factor_memory", evolver_.factor);
        visit("crossover_memory", evolver_.crossover);
        visit("drawn_factor", evolver_.drawn_factor);
        visit("drawn_crossover", evolver_.drawn_crossover);
        visit("gain", evolver_.gain);
        std::vector<T> scalars = {best_.violation, best_.fitness, first_tolerance_};
        visit("scalars", scalars);
        best_ = {scalars[0], scalars[1]};
        first_tolerance_ = scalars[2];
    }
    std::vector<std::int64_t> counters() const {
        return {round_, used_, failed_, active(), evolver_.next, asked_ ? 1 : 0};
    }
    bool fits(const std::vector<std::int64_t>& c) const {
        const bool shrinks = settings_.variant == swarm_variant::evolving;
        const auto counted = [](std::int64_t n, std::int64_t most) { return n >= 0 && n <= most; };
        return c.size() == 6 && (shrinks ? c[3] > first_[2] : c[3] == first_[3]) && c[3] <= settings_.particles
               && counted(c[0], most_rounds) && counted(c[1], most_evaluations) && counted(c[2], most_evaluations)
               && counted(c[4], settings_.memory - 1);
    }
    // Between an ask and its tell, population 3's candidates are waiting to be judged.
    bool fits_candidates(const std::vector<std::int64_t>& c, std::size_t drawn) const {
        const std::int64_t waiting =
            c[5] != 0 && c[0] > 0 && evolving_from_ < settings_.particles ? c[3] - evolving_from_ : 0;
        return static_cast<std::int64_t>(drawn) >= waiting && drawn <= static_cast<std::size_t>(stride_);
    }
    void restore_counters(const std::vector<std::int64_t>& c) {
        round_ = static_cast<int>(c[0]);
        used_ = c[1];
        failed_ = c[2];
        first_[3] = static_cast<int>(c[3]);
        evolver_.next = static_cast<int>(c[4]);
        asked_ = c[5] != 0;
        apply_schedule();
        judge_personal_bests();
        find_leaders();
    }

  private:
    std::size_t at(int d, int i) const { return static_cast<std::size_t>(d) * stride_ + i; }

    void split_populations() {
        const int n = settings_.particles;
        int each = 0;
        populations_ = 3;
        if (settings_.variant == swarm_variant::pso) {
            each = n;
            populations_ = 1;
        } else if (settings_.variant == swarm_variant::evolving) {
            each = static_cast<int>((1 - settings_.evolving_share) * n / 2 + 1e-9);
        } else {
            each = std::max(1, n / 3);
        }
        first_[1] = std::min(n, each);
        first_[2] = std::min(n, 2 * each);
        first_[3] = n;
        evolving_from_ = settings_.variant == swarm_variant::evolving ? first_[2] : n;
    }

    // ---- schedules, all over the share of the budget that is spent --------------------------------------------------
    double progress() const {
        return std::min(1.0, static_cast<double>(used_)
                                 / static_cast<double>(std::max<std::int64_t>(1, settings_.evaluations)));
    }
    T inertia() const {  // eq. (14)
        return static_cast<T>(settings_.inertia_start - (settings_.inertia_start - settings_.inertia_end) * progress());
    }
    void apply_schedule() {
        // Forgiven violation, falling as (1 - t/T)^power (Takahama and Sakai 2006).
        const double left = std::max(0.0, 1.0 - progress() / settings_.tolerance_until);
        double share = 1;
        for (int i = 0; i < settings_.tolerance_power; ++i) share *= left;
        tolerance_ = first_tolerance_ * static_cast<T>(share);
        const double s =
            std::max(0.0, progress() - settings_.penalty_rise) / std::max(1e-12, 1.0 - settings_.penalty_rise);
        penalty_ = static_cast<T>(settings_.penalty_start + (settings_.penalty_end - settings_.penalty_start) * s * s);
    }
    void start_tolerance() {
        first_tolerance_ = T(0);
        if (settings_.tolerance_share <= 0) return;
        std::vector<T> sorted(violation_.begin(), violation_.begin() + active());
        const std::size_t k =
            std::min(sorted.size() - 1, static_cast<std::size_t>(settings_.tolerance_share * sorted.size()));
        std::nth_element(sorted.begin(), sorted.begin() + k, sorted.end());
        first_tolerance_ = std::isfinite(sorted[k]) ? sorted[k] : T(0);
    }

    // ---- judging ----------------------------------------------------------------------------------------------------
    struct judged_packs {
        pack<T> violation, fitness;
    };
    SPACEARM_INLINE judged_packs judge(const T* fitness, const T* violation) const {
        const pack<T> f = pack<T>::load(fitness), c = pack<T>::load(violation);
        if (settings_.constraints == constraint_rule::penalty) {
            // Infinity times a weight of 0 would be no number.
            return {pack<T>(T(0)), f + min(c, pack<T>(std::numeric_limits<T>::max())) * penalty_};
        }
        return {select(pack<T>(tolerance_) < c, c, pack<T>(T(0))), f};
    }
    void judge_personal_bests() {
        for (int i = 0; i < active(); i += W) {
            const judged_packs p = judge(&best_fitness_[i], &best_violation_[i]);
            p.fitness.store(&merit_fitness_[i]);
            p.violation.store(&merit_violation_[i]);
        }
    }
    merit<T> personal(int i) const { return {merit_violation_[i], merit_fitness_[i]}; }

    void sort_out_failures() {
        const pack<T> worst(infinity);
        for (int i = 0; i < active(); i += W) {
            const pack<T> f = pack<T>::load(&fitness_[i]), c = pack<T>::load(&violation_[i]);
            const pack_mask<T> fine = (f <= worst) & (c <= worst);  // false for a NaN
            select(fine, f, worst).store(&fitness_[i]);
            select(fine, max(c, pack<T>(T(0))), worst).store(&violation_[i]);
            const pack<T> failed = select(fine, pack<T>(T(0)), pack<T>(T(1)));
            if (!any(pack<T>(T(0)) < failed)) continue;
            T one[W];
            failed.store(one);
            failed_ += W - std::count(one, one + W, T(0));
        }
    }

    // The best of all is judged feasible first and never with forgiveness, whatever the swarm goes by.
    void update_global_best() {
        int found = -1;
        if (round_ == 0) {  // someone is best even if every evaluation failed
            best_ = {violation_[0], fitness_[0]};
            found = 0;
        }
        for (int i = 0; i < active(); i += W) {
            const pack<T> f = pack<T>::load(&fitness_[i]), c = pack<T>::load(&violation_[i]);
            if (!any((c < best_.violation) | ((c <= best_.violation) & (f < best_.fitness)))) continue;
            for (int k = i; k < std::min(i + W, active()); ++k) {
                const merit<T> now{violation_[k], fitness_[k]};
                if (!now.better_than(best_)) continue;
                best_ = now;
                found = k;
            }
        }
        for (int d = 0; found >= 0 && d < dims_; ++d) best_x_[d] = x_[at(d, found)];
    }

    // Personal bests, a pack at a time.
    void update_personal_bests() {
        const int n = active();
        if (round_ == 0) {  // the first position is the best so far, also where it could not be evaluated
            px_ = x_;
            best_fitness_ = fitness_;
            best_violation_ = violation_;
            judge_personal_bests();
            return;
        }
        for (int i = 0; i < n; i += W) {
            const judged_packs now = judge(&fitness_[i], &violation_[i]),
                               old = judge(&best_fitness_[i], &best_violation_[i]);
            const pack_mask<T> improved =
                (now.violation < old.violation) | ((now.violation <= old.violation) & (now.fitness < old.fitness));
            if (!any(improved)) {
                old.fitness.store(&merit_fitness_[i]);
                old.violation.store(&merit_violation_[i]);
                continue;
            }
            if (i + W > evolving_from_) note_successes(i, improved, now, old);
            select(improved, now.fitness, old.fitness).store(&merit_fitness_[i]);
            select(improved, now.violation, old.violation).store(&merit_violation_[i]);
            select(improved, pack<T>::load(&fitness_[i]), pack<T>::load(&best_fitness_[i])).store(&best_fitness_[i]);
            select(improved, pack<T>::load(&violation_[i]), pack<T>::load(&best_violation_[i]))
                .store(&best_violation_[i]);
            for (int d = 0; d < dims_; ++d) {
                T* p = &px_[at(d, i)];
                select(improved, pack<T>::load(&x_[at(d, i)]), pack<T>::load(p)).store(p);
            }
        }
        if (evolving_from_ < settings_.particles) evolver_.learn();
    }

    void note_successes(int i, const pack_mask<T>& improved, const judged_packs& now, const judged_packs& old) {
        T hit[W], nf[W], nc[W], of[W], oc[W];
        select(improved, pack<T>(T(1)), pack<T>(T(0))).store(hit);
        now.fitness.store(nf);
        now.violation.store(nc);
        old.fitness.store(of);
        old.violation.store(oc);
        const random_key key(seed_, trial_, stream::archive);
        for (int k = 0; k < W; ++k) {
            const int particle = i + k;
            if (hit[k] == T(0) || particle < evolving_from_ || particle >= active()) continue;
            evolver_.succeeded(particle - evolving_from_, nc[k] < oc[k] ? oc[k] - nc[k] : of[k] - nf[k]);
            evolver_.keep(key, round_, particle, px_, stride_, dims_,
                          static_cast<int>(archive_share * (active() - evolving_from_)));
        }
    }
    static constexpr double archive_share = 1.4;
    void find_leaders() {
        int first = first_[1] > 0 ? 0 : first_[2] > 0 ? 1 : 2;  // a population that has members
        for (int k = 0; k < populations_; ++k) {
            const int p = (first + k) % populations_;
            int best = first_[p] < first_[p + 1] ? first_[p] : leader_[first];  // an empty one borrows a leader
            for (int i = first_[p] + 1; i < first_[p + 1]; ++i) {
                if (personal(i).better_than(personal(best))) best = i;
            }
            leader_[p] = best;
        }
    }

    // Population 3 loses its worst members as the budget is spent.
    void shrink() {
        const int whole = settings_.particles - first_[2];
        const int remaining =
            std::max(settings_.shrink_to, static_cast<int>(whole - (whole - settings_.shrink_to) * progress() + 0.5));
        const int now = first_[3] - first_[2];
        if (remaining >= now || first_[2] == first_[3]) return;
        const std::vector<int> order = ranked(first_[2], first_[3]);
        for (std::vector<T>* values : {&best_fitness_, &best_violation_, &merit_fitness_, &merit_violation_})
            reorder(values->data(), order);
        for (int d = 0; d < dims_; ++d) reorder(&px_[at(d, 0)], order);
        first_[3] = first_[2] + remaining;
        evolver_.trim(dims_, static_cast<int>(archive_share * remaining));
        leader_[2] = first_[2];
    }
    std::vector<int> ranked(int from, int to) const {
        return ranked_by(from, to, [&](int i, int k) { return personal(i).better_than(personal(k)); });
    }

    // ---- moving -----------------------------------------------------------------------------------------------------
    // Round 0: positions uniform within the bounds, velocities in +- a share of the range.
    void start() {
        const random_key where(seed_, trial_, stream::start_position), how(seed_, trial_, stream::start_velocity);
        for (int i = 0; i < stride_; i += word_lanes) {
            for (int d = 0; d < dims_; d += 4) {
                const uniform_block<T> x = uniforms<T>(where, 0, i, d / 4), v = uniforms<T>(how, 0, i, d / 4);
                for (int k = 0; k < 4 && d + k < dims_; ++k) {
                    const T range = upper_[d + k] - lower_[d + k];
                    for (int g = 0; g < packs_of_words<T>; ++g) {
                        const std::size_t here = at(d + k, i + g * W);
                        min(pack<T>(lower_[d + k]) + x.u[k][g] * range, pack<T>(upper_[d + k])).store(&x_[here]);
                        ((v.u[k][g] + v.u[k][g] - T(1)) * (range * T(settings_.start_velocity))).store(&v_[here]);
                    }
                }
            }
        }
    }

    // What each particle follows: its population's best, or the best of its neighbours on a ring.
    void prepare_social() {
        const int k = settings_.ring;
        for (int p = 0; p < populations_; ++p) {
            const int begin = first_[p], end = std::min(first_[p + 1], evolving_from_), size = end - begin;
            if (size <= 0) continue;
            if (k > 0 && k < (size - 1) / 2 + (size - 1) % 2) {  // 2 k + 1 < size: no particle twice
                follow_neighbours(begin, size, k);
                continue;
            }
            for (int d = 0; d < dims_; ++d)
                std::fill(&social_[at(d, begin)], &social_[at(d, begin)] + size, px_[at(d, leader_[p])]);
        }
    }

    void follow_neighbours(int begin, int size, int k) {
        follow_ring(
            size, k, [&](int i, int j) { return personal(begin + i).better_than(personal(begin + j)); }, guide_);
        for (int d = 0; d < dims_; ++d) {
            const T* from = &px_[at(d, 0)];
            T* to = &social_[at(d, begin)];
            for (int i = 0; i < size; ++i) to[i] = from[begin + guide_[i]];
        }
    }

    // Variant M: the master weighs its own best against the slaves' best: Phi = 0, 1/2, 1 as f(gS) <, =, > f(gM).
    void prepare_symbiotic() {
        const int slave = personal(leader_[1]).better_than(personal(leader_[0])) ? leader_[1] : leader_[0];
        const merit<T> master = personal(leader_[2]), slaves = personal(slave);
        const double phi = slaves.better_than(master) ? 0.0 : master.better_than(slaves) ? 1.0 : 0.5;
        for (int i = first_[2]; i < first_[3]; ++i) {
            weight1_[i] = static_cast<T>(phi * settings_.social);
            weight2_[i] = static_cast<T>((1 - phi) * settings_.cooperation);
            for (int d = 0; d < dims_; ++d) social2_[at(d, i)] = px_[at(d, slave)];
        }
    }

    // Variant S: one best g is shared by all, and the velocity that population 3 carries on is
    // (G/G1) v1 + (G/G2) v2 + v3, with G1, G2 the fitness of its counterparts and G = G1 + G2.
    void prepare_cooperative() {
        carried_ = v_;
        const int size = first_[1];
        for (int i = first_[2]; i < first_[3]; ++i) {
            const int one = (i - first_[2]) % size, two = first_[1] + one;
            const T g1 = fitness_[one], g2 = fitness_[two], g = g1 + g2;
            const T a = g / g1, b = g / g2;
            if (!std::isfinite(a) || !std::isfinite(b)) continue;  // a failed evaluation drives nobody
            for (int d = 0; d < dims_; ++d) carried_[at(d, i)] = a * v_[at(d, one)] + b * v_[at(d, two)] + v_[at(d, i)];
        }
    }
    void share_leader() {
        int best = leader_[0];
        for (int p = 1; p < populations_; ++p) {
            if (personal(leader_[p]).better_than(personal(best))) best = leader_[p];
        }
        for (int p = 0; p < populations_; ++p) leader_[p] = best;
    }

    void step() {
        if (settings_.variant == swarm_variant::cooperative) share_leader();
        if (evolving_from_ > 0) move_by_velocity();
        if (evolving_from_ < settings_.particles) evolve();
    }

    void move_by_velocity() {
        prepare_social();
        if (settings_.variant == swarm_variant::symbiotic) prepare_symbiotic();
        if (settings_.variant == swarm_variant::cooperative) prepare_cooperative();
        const random_key key(seed_, trial_, stream::velocity);
        const pack<T> w(inertia()), c1(T(settings_.cognitive)), c2(T(settings_.social));
        const bool symbiotic = settings_.variant == swarm_variant::symbiotic;
        const std::vector<T>& momentum = carried_.empty() ? v_ : carried_;
        for (int i = 0; i < std::min(active(), evolving_from_); i += word_lanes) {
            uniform_block<T> r3;
            for (int d = 0; d < dims_; d += 2) {
                const uniform_block<T> r = uniforms<T>(key, round_, i, d / 2);
                if (symbiotic && d % 4 == 0) r3 = uniforms<T>(key, round_, i, 0x10000u + d / 4);
                for (int k = 0; k < 2 && d + k < dims_; ++k) {
                    for (int g = 0; g < packs_of_words<T>; ++g) {
                        const int first = i + g * W;
                        const std::size_t here = at(d + k, first);
                        const pack<T> x = pack<T>::load(&x_[here]);
                        pack<T> v = w * pack<T>::load(&momentum[here])  // eq. (13)
                                    + c1 * r.u[2 * k][g] * (pack<T>::load(&px_[here]) - x);
                        if (!symbiotic) {
                            v += c2 * r.u[2 * k + 1][g] * (pack<T>::load(&social_[here]) - x);
                        } else {
                            v += pack<T>::load(&weight1_[first]) * r.u[2 * k + 1][g]
                                 * (pack<T>::load(&social_[here]) - x);
                            v += pack<T>::load(&weight2_[first]) * r3.u[d % 4 + k][g]
                                 * (pack<T>::load(&social2_[here]) - x);
                        }
                        move(d + k, here, x, v);
                    }
                }
            }
        }
    }

    SPACEARM_INLINE void move(int d, std::size_t here, const pack<T>& x, pack<T> v) {
        const T lo = lower_[d], hi = upper_[d], range = hi - lo;
        if (settings_.velocity_clamp > 0) {
            const pack<T> most(range * T(settings_.velocity_clamp));
            v = clamp(v, -most, most);
        }
        pack<T> to = x + v;
        const pack<T> low(lo), high(hi);
        const pack_mask<T> stays = (low <= to) & (to <= high);  // no NaN does
        if (!all(stays)) {
            const pack<T> inside = clamp(to, low, high), zero(T(0));
            if (settings_.bounds == bounds_rule::absorb) {
                v = select(stays, v, zero);
                to = inside;
            } else if (settings_.bounds == bounds_rule::reflect) {
                v = select(stays, v, -v);
                to = clamp(inside + inside - to, low, high);
            } else {
                const pack<T> turns = range > T(0) ? nearest((to - low) / range - T(0.5)) : zero;
                to = clamp(to - turns * range, low, high);
            }
            v = select(abs(v) <= pack<T>(std::numeric_limits<T>::max()), v, zero);  // what has run away begins anew
        }
        v.store(&v_[here]);
        to.store(&x_[here]);
    }

    // Population 3 recombines: the elite it steers towards are its own best and the leaders of populations 1 and 2.
    void evolve() {
        const int from = evolving_from_, n = active() - from;
        std::vector<int> elite = ranked(from, active());
        elite.resize(std::max(std::min(2, n), static_cast<int>(settings_.elite_share * n + 0.5)));
        for (int p = 0; p < 2; ++p) {
            if (first_[p] < first_[p + 1]) elite.push_back(leader_[p]);
        }
        evolver_.begin(n);
        const random_key key(seed_, trial_, stream::evolution);
        for (int i = 0; i < n; ++i) {
            evolver_.propose({key, {static_cast<std::uint32_t>(from + i), static_cast<std::uint32_t>(round_)}}, i, from,
                             n, elite, px_.data(), stride_, lower_, upper_, x_.data());
        }
    }

    swarm_settings settings_;
    int dims_, stride_ = 0, populations_ = 1, evolving_from_ = 0;
    int first_[4] = {}, leader_[3] = {};
    std::vector<T> lower_, upper_;
    std::uint64_t seed_;
    std::uint32_t trial_;
    int round_ = 0;
    bool asked_ = false;
    std::int64_t used_ = 0, failed_ = 0;
    T tolerance_ = 0, first_tolerance_ = 0, penalty_ = 0;
    merit<T> best_{infinity, infinity};
    std::vector<T> x_, v_, px_, social_, social2_, weight1_, weight2_, carried_;
    std::vector<T> fitness_, violation_, best_fitness_, best_violation_, merit_fitness_, merit_violation_, best_x_;
    std::vector<int> guide_;
    evolver<T> evolver_;
};

}  // namespace SPACEARM_NAMESPACE
