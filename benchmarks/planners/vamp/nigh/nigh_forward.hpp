#pragma once

#include "nearest.hpp"
