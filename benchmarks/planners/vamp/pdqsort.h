// VAMP sorts by a library that is fetched at build time; the standard one does.
#pragma once

#include <algorithm>

template <class Iterator, class Less> void pdqsort(Iterator first, Iterator last, Less less) { std::sort(first, last, less); }
template <class Iterator, class Less> void pdqsort_branchless(Iterator first, Iterator last, Less less) { std::sort(first, last, less); }
