#include "tools/measure/shape.h"

#include <algorithm>

namespace keratin::measure {

namespace {

struct Gather {
    Spread spread;
    std::size_t count = 0;
    void add(double value) {
        spread.max = std::max(spread.max, value);
        spread.mean += value;
        ++count;
    }
    Spread done() const {
        return {spread.max, count ? spread.mean / static_cast<double>(count) : 0};
    }
};

}  // namespace

Spread stretch(const Strands& strands, const Strands& rest) {
    Gather gather;
    for (std::size_t s = 0; s < strands.count(); ++s) {
        const auto now = strands.strand(s), then = rest.strand(s);
        for (std::size_t p = 1; p < now.size(); ++p) {
            const double rest_length = distance(then[p], then[p - 1]);
            if (rest_length > 0)
                gather.add(std::abs(distance(now[p], now[p - 1]) / rest_length - 1));
        }
    }
    return gather.done();
}

Spread tip_lag(const Strands& strands, const Strands& rigid) {
    Gather gather;
    for (std::size_t s = 0; s < strands.count(); ++s)
        if (!strands.strand(s).empty())
            gather.add(distance(strands.strand(s).back(), rigid.strand(s).back()));
    return gather.done();
}

Spread point_distance(std::span<const Point> a, std::span<const Point> b) {
    Gather gather;
    for (std::size_t i = 0; i < a.size(); ++i) gather.add(distance(a[i], b[i]));
    return gather.done();
}

}  // namespace keratin::measure
