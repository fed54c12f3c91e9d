// Whole runs, natively: many independent trials of a swarm on an objective, spread over threads.
//
// A trial's numbers depend on (seed, trial) only, so the results are the same bits on any number of threads. Where the
// system starts no more of them, those that run do all the work; the calling thread always does.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>

#include "swarm/swarm.hpp"

namespace SPACEARM_NAMESPACE {

struct search_limits {
    bool stop_when_feasible = false;
    double seconds = 0;  // per trial; 0 for no limit
};

template <class T> struct trial_result {
    merit<T> best;
    std::vector<T> position;
    int rounds = 0;
    std::int64_t evaluations = 0;
    int first_feasible_round = -1;
    // One entry a round: the swarm's best so far.
    std::vector<T> fitness, violation, positions;
    std::vector<std::int64_t> spent;
};

inline constexpr int most_threads = 1024;
// Whether there is memory for one thread more and for its work: where a thread finds none for its own variables, the C
// library ends the process.
inline bool has_room() {
    constexpr std::size_t enough = std::size_t(128) << 20;
    void* room = std::malloc(enough);           // asked for, never touched
    asm volatile("" : : "r"(room) : "memory");  // so that the compiler does not leave it out
    std::free(room);
    return room != nullptr;
}

// Called now and then from the calling thread, with the rounds done so far; returns false to stop the search.
using progress_callback = std::function<bool(std::uint64_t)>;

template <class T, class Objective>
trial_result<T> run_trial(const Objective& objective, swarm<T>& particles, const search_limits& limits,
                          bool keep_positions, const std::function<bool()>& go_on,
                          const std::vector<std::vector<T>>& first_rows) {
    auto workspace = objective.make_workspace();
    const int stride = particles.stride(), dims = particles.dims();
    std::vector<pack<T>> q(dims);
    std::vector<T> fitness(stride), violation(stride);
    trial_result<T> out;
    while (!particles.spent() && out.rounds < most_rounds) {
        particles.ask();
        if (out.rounds == 0) particles.place_first(first_rows);
        const T* x = particles.positions();
        for (int i = 0; i < particles.active(); i += lanes_of<T>) {
            for (int d = 0; d < dims; ++d) q[d] = pack<T>::load(x + static_cast<std::size_t>(d) * stride + i);
            pack<T> f, c;
            objective(q.data(), workspace, f, c);
            f.store(&fitness[i]);
            c.store(&violation[i]);
        }
        particles.tell(fitness.data(), violation.data());
        const merit<T> best = particles.best();
        out.fitness.push_back(best.fitness);
        out.violation.push_back(best.violation);
        out.spent.push_back(particles.evaluations());
        if (keep_positions)
            out.positions.insert(out.positions.end(), particles.best_position().begin(),
                                 particles.best_position().end());
        if (best.violation <= T(0) && out.first_feasible_round < 0) out.first_feasible_round = out.rounds;
        ++out.rounds;
        if (!go_on() || (limits.stop_when_feasible && out.first_feasible_round >= 0)) break;
    }
    out.best = particles.best();
    out.evaluations = particles.evaluations();
    if (out.rounds > 0) out.position = particles.best_position();
    return out;
}

// make_swarm(trial) gives each trial its swarm. Returns the results in the trials' order; those not reached when the
// search was stopped have rounds == 0.
template <class T, class Objective, class MakeSwarm>
std::vector<trial_result<T>> run_trials(const Objective& objective, MakeSwarm make_swarm, int trials,
                                        const search_limits& limits, bool keep_positions, int threads,
                                        const progress_callback& tell_caller,
                                        const std::vector<std::vector<T>>& first_rows) {
    using clock = std::chrono::steady_clock;
    std::vector<trial_result<T>> results(trials);
    std::atomic<int> next{0}, running{0};
    std::atomic<std::uint64_t> rounds_done{0};
    std::stop_source stop;
    std::exception_ptr failure;
    std::mutex lock;
    std::condition_variable ended;

    auto work = [&](bool calling_thread) {
        auto told = clock::now();
        for (int trial = next++; trial < trials && !stop.stop_requested(); trial = next++) {
            auto begun = clock::now();
            auto go_on = [&] {
                ++rounds_done;
                if (limits.seconds > 0 || calling_thread) {
                    const auto now = clock::now();
                    if (calling_thread && now - told > std::chrono::milliseconds(40)) {
                        told = now;
                        if (tell_caller && !tell_caller(rounds_done)) stop.request_stop();
                    }
                    if (limits.seconds > 0 && std::chrono::duration<double>(now - begun).count() > limits.seconds)
                        return false;
                }
                return !stop.stop_requested();
            };
            swarm<T> particles = make_swarm(trial);
            results[trial] = run_trial<T>(objective, particles, limits, keep_positions, go_on, first_rows);
        }
    };
    auto guarded = [&](bool calling_thread) {
        try {
            work(calling_thread);
        } catch (...) {
            std::lock_guard<std::mutex> hold(lock);
            if (!failure) failure = std::current_exception();
            stop.request_stop();
        }
    };

    const int helpers = std::max(std::min({threads, trials, most_threads}) - 1, 0);
    std::vector<std::jthread> pool;
    pool.reserve(helpers);
    for (int i = 0; i < helpers && has_room(); ++i) {
        ++running;
        try {
            pool.emplace_back([&] {
                guarded(false);
                std::lock_guard<std::mutex> hold(lock);
                --running;
                ended.notify_one();
            });
        } catch (...) {  // no thread, or no memory for it: nothing may be thrown past those that run
            --running;
            break;
        }
    }
    guarded(true);
    {
        std::unique_lock<std::mutex> hold(lock);
        while (!ended.wait_for(hold, std::chrono::milliseconds(40), [&] { return running == 0; })) {
            if (stop.stop_requested() || !tell_caller) continue;
            hold.unlock();
            // Nothing may be thrown past threads that still run.
            std::exception_ptr thrown;
            try {
                if (!tell_caller(rounds_done)) stop.request_stop();
            } catch (...) {
                thrown = std::current_exception();
                stop.request_stop();
            }
            hold.lock();
            if (thrown && !failure) failure = thrown;
        }
    }
    pool.clear();  // joins them
    if (failure) std::rethrow_exception(failure);
    return results;
}

}  // namespace SPACEARM_NAMESPACE
