// The base models there are, and which of them a problem asks for.
#pragma once

#include "motion/fixed_base.hpp"
#include "motion/floating_base.hpp"

namespace SPACEARM_NAMESPACE {

template <class T> std::unique_ptr<base_model<T>> base_model_of(const motion_problem<T>& problem) {
    switch (problem.base.kind) {
        case base_kind::floating: return std::make_unique<floating_base<T>>(problem);
        case base_kind::fixed: break;
    }
    return std::make_unique<fixed_base<T>>(problem);
}

}  // namespace SPACEARM_NAMESPACE
