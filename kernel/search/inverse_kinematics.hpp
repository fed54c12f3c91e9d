// Inverse kinematics: free configurations that bring a frame to its goal, from many guesses side by side.
//
// Each lane of a pack runs damped least squares from a guess of its own: the start first, then configurations drawn
// within the bounds. A lane that is at the goal, or stuck, goes on with the next guess. What is at the goal is turned
// to where it is nearest to the start, and its clearance is checked. Of those that have the clearance asked for, some
// that differ are pulled towards the start while the frame stays where it is. What a guess leads to depends on the
// search's seed and the guess's number alone.
#pragma once

#include <numeric>

#include "lanes/random.hpp"
#include "search/goal_reach.hpp"

namespace SPACEARM_NAMESPACE {

struct goal_search_settings {
    std::vector<double> start, lower, upper;  // (n,) where to be near, and the box to search in [rad or m]
    std::vector<char> whole_turns;            // (n,) whether a whole turn moves no link
    double margin = 0;                        // [m] clearance asked for, of pairs without a margin of their own
    std::uint64_t seed = 0;
};

inline constexpr double differs = 0.2;  // [rad or m] configurations closer than this, in every joint, count as one
inline constexpr double wider = 1.3;    // factor of that distance, as long as there are more than asked for
inline constexpr int most_rounds_of_a_guess = 40;  // steps
inline constexpr int patience = 4;                 // rounds of a guess, within which the square of its error must halve
inline constexpr int pulls = 6;                    // steps towards the start
inline constexpr int rounds_of_a_pull = 4;
inline constexpr double centred = 1e-8;  // [m] error of what is at the goal's centre
inline constexpr double closer = 1e-3;   // [rad or m] by which a pull must bring a configuration nearer to the start
inline constexpr double shorter_pull = 0.4;  // factor of a pull after one that was no good
inline constexpr double whole_turn = 6.283185307179586;

using row = std::vector<double>;

inline double apart(const row& a, const row& b) {  // in any joint
    double greatest = 0;
    for (std::size_t d = 0; d < a.size(); ++d) greatest = std::max(greatest, std::abs(a[d] - b[d]));
    return greatest;
}

// The rows that differ, nearest to the start first, at most so many. What counts as near to one that was chosen is
// widened as long as enough are left: they are spread as wide as they can be.
inline std::vector<row> distinct(const std::vector<row>& rows, const row& start, int most) {
    require(most >= 1, "a number of configurations that is none");
    const auto away = [&](const row& q) {
        double sum = 0;
        for (std::size_t d = 0; d < q.size(); ++d) sum += (q[d] - start[d]) * (q[d] - start[d]);
        return sum;
    };
    std::vector<double> distance;
    for (const row& one : rows) distance.push_back(away(one));
    std::vector<int> order(rows.size()), chosen;
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int i, int k) { return distance[i] < distance[k]; });
    for (double radius = differs;; radius *= wider) {
        std::vector<int> now;
        for (int i : order) {
            if (static_cast<int>(now.size()) == most) break;
            if (std::all_of(now.begin(), now.end(), [&](int k) { return apart(rows[i], rows[k]) > radius; }))
                now.push_back(i);
        }
        if (chosen.empty() || static_cast<int>(now.size()) == most) chosen = now;
        if (static_cast<int>(now.size()) < most || now.size() <= 1) break;
    }
    std::vector<row> out;
    for (int i : chosen) out.push_back(rows[i]);
    return out;
}

// What a guess led to.
struct guess_result {
    row q;
    int guess = 0;  // its number
    double lacking =
        0;  // at the goal: by how much clearances fall short, summed [m]; else the square of the error [m^2]
};

template <class T> class goal_search {
  public:
    static constexpr int W = lanes_of<T>;

    goal_search(const model<T>& m, const terminal_constraints& goal, goal_search_settings s)
        : model_(m), reach_(make_reach(m.robot, goal)), s_(std::move(s)), n_(m.robot.dofs), memory_(reach_), work_(m),
          bodies_(m.envelope), q_(reach_.width()), all_(n_), moves_frame_(n_) {
        require(s_.start.size() == n_ && s_.lower.size() == n_ && s_.upper.size() == n_ && s_.whole_turns.size() == n_,
                "the start, bounds or turns have another length");
        require(all_within(s_.start, widest) && all_within(s_.lower, widest) && all_within(s_.upper, widest)
                    && within(s_.margin, widest),
                "a number that is none, or too large");
        for (std::size_t d = 0; d < n_; ++d) require(s_.lower[d] <= s_.upper[d], "bounds that are no range");
        for (int entry : reach_.entries) {
            lower_.push_back(static_cast<T>(s_.lower[entry]));
            upper_.push_back(static_cast<T>(s_.upper[entry]));
            moves_frame_[entry] = 1;
        }
    }

    std::size_t dofs() const { return n_; }
    int begun() const { return begun_; }  // guesses
    int reached() const { return static_cast<int>(found_.size()); }
    int in_collision() const { return in_collision_; }  // of those

    // Goes on with so many guesses more; go_on is called now and then.
    template <class GoOn> void look(int guesses, GoOn&& go_on) {
        const std::size_t before = found_.size();
        run_lanes(begun_ + guesses, go_on);
        std::stable_sort(found_.begin() + before, found_.end(),
                         [](const guess_result& a, const guess_result& b) { return a.guess < b.guess; });
        check(before);
    }

    // At most so many that differ, of those that have the clearance asked for.
    std::vector<row> differing(int most) const {
        std::vector<row> rows;
        for (const guess_result& one : found_) {
            if (one.lacking <= 0) rows.push_back(one.q);
        }
        return distinct(rows, s_.start, most);
    }

    // At most so many of the others, those that lack least first.
    std::vector<row> lacking(int most) const {
        std::vector<guess_result> others;
        for (const guess_result& one : found_) {
            if (!(one.lacking <= 0)) others.push_back(one);
        }
        return least_of(std::move(others), most);
    }
    // At most so many of where the guesses ended that missed the goal, the nearest to it first.
    std::vector<row> missed(int most) const { return least_of(missed_, most); }

    // At most so many of configurations, and with `pull` of what they become when they are pulled towards the start:
    // those that differ. at_centre: they are to stay at the goal's very centre.
    std::vector<row> pulled(const std::vector<row>& rows, int most, bool pull, bool at_centre) {
        std::vector<row> all;
        for (std::size_t first = 0; pull && first < rows.size(); first += W)
            pull_pack(&rows[first], std::min<std::size_t>(W, rows.size() - first), at_centre, all);
        all.insert(all.end(), rows.begin(), rows.end());
        return distinct(all, s_.start, most);
    }

    // Configurations and, until there are `most`, those that are a whole turn of a joint away from them, which moves no
    // link: nearest to the start first.
    std::vector<row> with_turns(std::vector<row> rows, int most) const {
        std::vector<row> more;
        if (static_cast<int>(rows.size()) >= most) return rows;
        for (const row& one : rows) {
            for (std::size_t d = 0; d < n_; ++d) {
                for (double turn : {-whole_turn, whole_turn}) {
                    if (!s_.whole_turns[d] || one[d] + turn < s_.lower[d] || one[d] + turn > s_.upper[d]) continue;
                    row turned(one);
                    turned[d] += turn;
                    const bool known = std::any_of(rows.begin(), rows.end(),
                                                   [&](const row& other) { return apart(turned, other) <= differs; });
                    if (!known) more.push_back(std::move(turned));
                }
            }
        }
        for (row& one : distinct(more, s_.start, most - static_cast<int>(rows.size()))) rows.push_back(std::move(one));
        return rows;
    }

  private:
    // ---- guesses ---------------------------------------------------------------------------------------------------
    struct lane {
        int guess = -1;  // its number; -1: at rest
        int round = 0;
        T checkpoint = 0;  // the square of its error some rounds ago
        row q;             // where it begins, and ends
    };

    // The start, then drawn ones: anywhere, and on the way from the start to there, in turn. Entries that do not move
    // the frame stay where the start has them in every second pair of guesses.
    row guess_of(int number) const {
        row q = s_.start;
        for (std::size_t d = 0; d < n_; ++d) q[d] = std::clamp(q[d], s_.lower[d], s_.upper[d]);
        if (number == 0) return q;
        const random_key key(s_.seed, 0, stream::goal_guesses);
        const auto draw = [&](std::uint32_t block, double (&u)[4]) {
            uniforms_one<double>(key, 0, static_cast<std::uint32_t>(number), block, u);
        };
        double u[4] = {}, share[4];
        draw(0, share);
        if (number % 2 != 0) share[0] = 1;
        for (std::size_t d = 0; d < n_; ++d) {
            if (d % 4 == 0) draw(static_cast<std::uint32_t>(1 + d / 4), u);
            if (!moves_frame_[d] && number % 4 < 2) continue;
            q[d] += share[0] * (s_.lower[d] + u[d % 4] * (s_.upper[d] - s_.lower[d]) - q[d]);
        }
        return q;
    }

    template <class GoOn> void run_lanes(int last, GoOn&& go_on) {
        const int width = reach_.width();
        std::vector<T> at(static_cast<std::size_t>(width) * W), next(at.size());
        std::vector<lane> lanes(W);
        std::vector<int> ended;
        int running = 0;
        const auto refill = [&](int i) {
            lanes[i].guess = -1;
            if (begun_ >= last) return;
            lanes[i] = {begun_, 0, T(0), guess_of(begun_)};
            for (int c = 0; c < width; ++c) at[c * W + i] = static_cast<T>(lanes[i].q[reach_.entries[c]]);
            ++begun_;
            ++running;
        };
        for (int i = 0; i < W; ++i) refill(i);
        while (running > 0) {
            go_on();
            T cost[W], there[W];
            step_lanes(at, next, cost, there);
            for (int i = 0; i < W; ++i) {
                if (lanes[i].guess < 0 || !has_ended(lanes[i], cost[i], there[i] > T(0))) continue;
                for (int c = 0; c < width; ++c) lanes[i].q[reach_.entries[c]] = double(at[c * W + i]);
                keep_result(lanes[i], double(cost[i]), there[i] > T(0));
                ended.push_back(i);
            }
            std::swap(at, next);
            running -= static_cast<int>(ended.size());
            for (int i : ended) refill(i);
            ended.clear();
        }
    }

    // One step of all lanes, a number a column and lane; the square of the error before it, and 1 where that is none.
    void step_lanes(const std::vector<T>& at, std::vector<T>& next, T* cost, T* there) {
        const pack<T> share(static_cast<T>(damping_share));
        for (int c = 0; c < reach_.width(); ++c) q_[c] = pack<T>::load(&at[c * W]);
        evaluate_goal(reach_, q_.data(), memory_);
        memory_.cost.store(cost);
        select(is_reached(reach_, memory_), pack<T>(T(1)), pack<T>(T(0))).store(there);
        damped_step(reach_, memory_, q_.data(), lower_.data(), upper_.data(), share, q_.data());
        for (int c = 0; c < reach_.width(); ++c) q_[c].store(&next[c * W]);
    }

    // Whether a lane is at the goal's centre, or stuck. The start may be anywhere within the goal's tolerance; others
    // that are within it have all rounds to come to the centre.
    static bool has_ended(lane& one, T cost, bool there) {
        const bool first = one.round == 0;
        bool stuck = one.round >= most_rounds_of_a_guess || !(cost <= std::numeric_limits<T>::max());
        if (one.round % patience == 0) {
            stuck = stuck || (!first && !there && !(cost <= one.checkpoint * T(0.5)));
            one.checkpoint = cost;
        }
        ++one.round;
        return cost <= static_cast<T>(converged * converged) || stuck || (there && first && one.guess == 0);
    }

    void keep_result(const lane& one, double cost, bool there) {
        if (there) found_.push_back({one.q, one.guess, 0});
        else missed_.push_back({one.q, one.guess, cost});
    }
    static std::vector<row> least_of(std::vector<guess_result> from, int most) {
        std::sort(from.begin(), from.end(), [](const guess_result& a, const guess_result& b) {
            return a.lacking != b.lacking ? a.lacking < b.lacking : a.guess < b.guess;
        });
        std::vector<row> out;
        for (std::size_t i = 0; i < from.size() && static_cast<int>(i) < most; ++i) out.push_back(from[i].q);
        return out;
    }

    // ---- clearance --------------------------------------------------------------------------------------------------
    void turn_nearest(row& q) const {
        for (std::size_t d = 0; d < n_; ++d) {
            if (!s_.whole_turns[d]) continue;
            for (double k = std::rint((q[d] - s_.start[d]) / whole_turn); k != 0; k -= k > 0 ? 1 : -1) {
                const double there = q[d] - k * whole_turn;
                if (there < s_.lower[d] || there > s_.upper[d]) continue;
                q[d] = there;
                break;
            }
        }
    }

    // Those found since: turned nearest to the start, and what they lack.
    void check(std::size_t since) {
        std::vector<row> rows, doubtful;
        for (std::size_t i = since; i < found_.size(); ++i) {
            if (found_[i].guess > 0) turn_nearest(found_[i].q);
            rows.push_back(found_[i].q);
        }
        const std::vector<double> lacking = lacking_of(rows, false);
        for (std::size_t i = 0; i < rows.size(); ++i) {
            found_[since + i].lacking = lacking[i];
            if (!(lacking[i] <= 0)) doubtful.push_back(rows[i]);
        }
        for (double depth : lacking_of(doubtful, true)) in_collision_ += depth <= 0 ? 0 : 1;
    }
    std::vector<double> lacking_of(const std::vector<row>& rows, bool contact_only) {
        std::vector<double> out;
        for (std::size_t first = 0; first < rows.size(); first += W) {
            const std::size_t filled = std::min<std::size_t>(W, rows.size() - first);
            load(&rows[first], filled);
            T lanes[W];
            lacking_of_pack(contact_only).store(lanes);
            out.insert(out.end(), lanes, lanes + filled);
        }
        return out;
    }
    // Of the configurations in all_; contact_only: how far they are inside what they meet.
    pack<T> lacking_of_pack(bool contact_only) {
        forward_kinematics(model_.robot, all_.data(), work_.frames.data());
        asked_clearance<T> asked{static_cast<T>(s_.margin)};
        if (contact_only) asked = {T(0), true, T(0)};
        return shortfall<T>(model_.envelope, work_.frames.data(), model_.obstacles, asked, bodies_, false);
    }
    void load(const row* rows, std::size_t filled) {
        T lanes[W];
        for (std::size_t d = 0; d < n_; ++d) {
            for (std::size_t i = 0; i < W; ++i) lanes[i] = static_cast<T>(rows[std::min(i, filled - 1)][d]);
            all_[d] = pack<T>::load(lanes);
        }
    }

    // ---- towards the start ------------------------------------------------------------------------------------------
    void pull_pack(const row* rows, std::size_t filled, bool at_centre, std::vector<row>& out) {
        load(rows, filled);
        std::vector<pack<T>> here(all_);
        const pack<T> lacking = lacking_of_pack(false);
        for (int c = 0; c < reach_.width(); ++c) q_[c] = all_[reach_.entries[c]];
        evaluate_goal(reach_, q_.data(), memory_);
        const pack<T> centre = max(memory_.cost, pack<T>(static_cast<T>(centred * centred)));
        pack<T> away = from_start(), share(T(0.5));
        for (int pull = 0; pull < pulls; ++pull) {
            all_ = here;
            step_to_start(share, at_centre);
            evaluate_goal(reach_, q_.data(), memory_);
            const pack<T> new_away = from_start();
            pack_mask<T> good = is_reached(reach_, memory_) & (new_away < away - static_cast<T>(closer));
            if (at_centre) good = good & (memory_.cost <= centre);
            if (any(good)) good = good & (lacking_of_pack(false) <= lacking);
            for (std::size_t d = 0; d < n_; ++d) here[d] = select(good, all_[d], here[d]);
            away = select(good, new_away, away);
            share = share * select(good, pack<T>(T(1)), pack<T>(static_cast<T>(shorter_pull)));
        }
        const std::size_t first = out.size();
        out.resize(first + filled, row(n_));
        for (std::size_t d = 0; d < n_; ++d) {
            T lanes[W];
            here[d].store(lanes);
            for (std::size_t i = 0; i < filled; ++i) out[first + i][d] = double(lanes[i]);
        }
    }
    // Moves all_ a share of the way to the start, less what the frame would see of it.
    void step_to_start(const pack<T>& share, bool at_centre) {
        const int width = reach_.width();
        std::vector<pack<T>> wish(n_);
        for (std::size_t d = 0; d < n_; ++d) wish[d] = pack<T>(static_cast<T>(s_.start[d])) - all_[d];
        for (int c = 0; c < width; ++c) q_[c] = all_[reach_.entries[c]];
        evaluate_goal(reach_, q_.data(), memory_);
        pack<T> seen[6];
        for (int i = 0; i < 6; ++i) {
            seen[i] = pack<T>(T(0));
            for (int c = 0; c < width; ++c) seen[i] += memory_.jacobian[6 * c + i] * wish[reach_.entries[c]];
        }
        damped_least_squares(reach_, memory_.jacobian.data(), seen, pack<T>(T(1e-9)), memory_.step.data());
        for (int c = 0; c < width; ++c) wish[reach_.entries[c]] -= memory_.step[c];
        for (std::size_t d = 0; d < n_; ++d) wish[d] = wish[d] * share;
        limit_step(wish.data(), static_cast<int>(n_));
        for (std::size_t d = 0; d < n_; ++d) {
            all_[d] =
                clamp(all_[d] + wish[d], pack<T>(static_cast<T>(s_.lower[d])), pack<T>(static_cast<T>(s_.upper[d])));
        }
        for (int c = 0; c < width; ++c) q_[c] = all_[reach_.entries[c]];
        if (at_centre) polish(reach_, memory_, q_.data(), lower_.data(), upper_.data(), rounds_of_a_pull);
        for (int c = 0; c < width; ++c) all_[reach_.entries[c]] = q_[c];
    }
    pack<T> from_start() const {
        pack<T> sum(T(0));
        for (std::size_t d = 0; d < n_; ++d) {
            const pack<T> step = all_[d] - static_cast<T>(s_.start[d]);
            sum += step * step;
        }
        return sqrt(sum);
    }

    const model<T>& model_;
    goal_reach<T> reach_;
    goal_search_settings s_;
    std::size_t n_;
    reach_memory<T> memory_;
    workspace<T> work_;
    envelope_memory<T> bodies_;
    std::vector<pack<T>> q_, all_;  // of the entries that move the frame, and of all
    std::vector<char> moves_frame_;
    std::vector<T> lower_, upper_;  // of those entries
    int begun_ = 0, in_collision_ = 0;
    std::vector<guess_result> found_, missed_;
};

// Brings configurations within the bounds, all side by side, to the goal's centre, or as near to it as bounds and arm
// allow: each no farther from it than it was, in metres and the lever times the chord of the angle.
template <class T>
std::vector<row> polished(const tree<T>& robot, const terminal_constraints& goal, std::vector<row> rows,
                          const row& lower, const row& upper, int rounds) {
    constexpr int W = lanes_of<T>;
    const goal_reach<T> reach = make_reach(robot, goal);
    reach_memory<T> memory(reach);
    std::vector<T> low, high;
    for (int entry : reach.entries) {
        low.push_back(static_cast<T>(lower[entry]));
        high.push_back(static_cast<T>(upper[entry]));
    }
    std::vector<pack<T>> q(reach.width());
    for (std::size_t first = 0; first < rows.size(); first += W) {
        const std::size_t filled = std::min<std::size_t>(W, rows.size() - first);
        T lanes[W];
        for (int c = 0; c < reach.width(); ++c) {
            for (std::size_t i = 0; i < W; ++i)
                lanes[i] = static_cast<T>(rows[first + std::min(i, filled - 1)][reach.entries[c]]);
            q[c] = pack<T>::load(lanes);
        }
        polish(reach, memory, q.data(), low.data(), high.data(), rounds);
        for (int c = 0; c < reach.width(); ++c) {
            q[c].store(lanes);
            for (std::size_t i = 0; i < filled; ++i) rows[first + i][reach.entries[c]] = double(lanes[i]);
        }
    }
    return rows;
}

}  // namespace SPACEARM_NAMESPACE
