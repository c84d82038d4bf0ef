#pragma once
#include <string>

#include <nlohmann/json.hpp>

#include "stats/boolean_model.h"
#include "stats/law.h"
#include "tools/console.h"
#include "vdb_ops/porous.h"
#include "vdb_ops/tradition.h"

namespace taihu {

/// What holes of a law, thrown at random, would make [m].
struct Prediction {
    Law law = Law::constant(1);
    double n_v_m3 = 0;
    BooleanModel model;
};

/// Of the JSON result of measure; keys with units.
nlohmann::ordered_json pores_json(const PoreMeasures& measures);
nlohmann::ordered_json tradition_json(const Tradition& tradition);
/// Measured beside predicted, one entry a number: `differs_se` in standard errors, null where they
/// are not known.
nlohmann::ordered_json comparison_json(const PoreMeasures& measures, const Prediction& prediction);

/// The same for people. \param where  the solid; \param base  its base, empty for none
void say_pores(const PoreMeasures& measures, const std::string& where, const std::string& base,
               const Console& console);
void say_tradition(const Tradition& tradition, const std::string& where, const Console& console);
void say_comparison(const PoreMeasures& measures, const Prediction& prediction,
                    const Console& console);

} // namespace taihu
