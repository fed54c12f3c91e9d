// Built until the finder's module is there.
#include "proof/bind_measure.hpp"

NB_MODULE(_measure, m) { spacearm_proof::bind_measure(m); }
