// Python threads and Ctrl-C, where the kernel computes without the GIL.
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

#include "python/arrays.hpp"

namespace SPACEARM_NAMESPACE {

// Of a long call without the GIL: now and then, whether somebody pressed Ctrl-C, which ends it.
class signal_listener {
  public:
    void ask() {
        const auto now = std::chrono::steady_clock::now();
        if (now - asked_ < std::chrono::milliseconds(40)) return;
        asked_ = now;
        nb::gil_scoped_acquire hold;
        if (PyErr_CheckSignals() != 0) throw nb::python_error();
    }

  private:
    std::chrono::steady_clock::time_point asked_ = std::chrono::steady_clock::now();
};

// An object that several Python threads may share does one thing at a time. Who waits does so without the GIL, which
// the one at work may want for its callback; the callback itself may only look.
class one_at_a_time {
  public:
    template <class Work> void operator()(Work&& work) {
        require(owner_.load() != std::this_thread::get_id(), "called by its own callback");
        nb::gil_scoped_release free;
        signal_listener signals;
        while (!lock_.try_lock_for(std::chrono::milliseconds(40))) signals.ask();
        const std::lock_guard<std::timed_mutex> hold(lock_, std::adopt_lock);
        const mine here(owner_);
        work();
    }
    // The same for what only looks: the one at work may look at itself from its own callback, where it stands still.
    template <class Work> void look(Work&& work) {
        if (owner_.load() == std::this_thread::get_id()) work();
        else (*this)(std::forward<Work>(work));
    }

  private:
    struct mine {
        std::atomic<std::thread::id>& owner;
        explicit mine(std::atomic<std::thread::id>& o) : owner(o) { owner = std::this_thread::get_id(); }
        ~mine() { owner = std::thread::id(); }
    };
    std::timed_mutex lock_;
    std::atomic<std::thread::id> owner_{};
};

}  // namespace SPACEARM_NAMESPACE
