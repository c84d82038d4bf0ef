#include "stats/density.h"

#include <cmath>

#include "stats/core/error.h"
#include "stats/detection.h"
#include "stats/number_detail.h"

namespace taihu {

NumberDensity expected_holes(const NumberDensity& n_v, double volume) {
    if (!(volume >= 0 && std::isfinite(volume)))
        throw Error(Fault::bad_argument,
                    "expected holes: volume is " + shortest(volume) + "; must be finite and >= 0");
    return {n_v.estimate * volume, n_v.lo * volume, n_v.hi * volume, n_v.extrapolated_share};
}

double profiles_per_area(const Sample& sample) {
    const Detection detection(sample);
    if (!detection.area())
        throw Error(Fault::bad_input,
                    "profiles per area: the area of the sample is unknown; give it");
    double sum = 0;
    for (const double d : sample.diameters)
        sum += 1 / detection.share(d);
    for (const Bin& bin : sample.bins)
        if (bin.count > 0)
            sum += static_cast<double>(bin.count) / detection.share(0.5 * (bin.lo + bin.hi));
    return sum / *detection.area();
}

} // namespace taihu
