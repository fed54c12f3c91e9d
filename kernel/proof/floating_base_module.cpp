// A module for tests, until the finder's has it: the floating base.
#include "proof/bind_floating_base.hpp"

NB_MODULE(_floating_base, m) { spacearm_proof::bind_floating_base(m); }
