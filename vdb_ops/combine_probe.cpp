#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include <boost/container/small_vector.hpp>

#include "vdb_ops/combine_field.h"
#include "vdb_ops/csg_field.h"
#include "vdb_ops/probe_detail.h"

namespace taihu {
namespace {

/// An operand: its distances times `sign`, its primitives from `first` on.
struct Operand {
    std::unique_ptr<FieldProbe> probe;
    double sign;
    Primitive first;
};

/// sign * min_i(sign_i * d_i), blended over `blend_m`; the blend is a primitive of its own, after
/// those of the operands.
class CombineProbe final : public FieldProbe {
public:
    CombineProbe(double sign, double blend_m, double reach_m, std::vector<Operand> operands,
                 Primitive n_operands_primitives)
        : sign_(sign), blend_m_(blend_m), reach_m_(reach_m), operands_(std::move(operands)),
          own_(n_operands_primitives) {}

    Nearest at(const Vec3& p) const override {
        double least = std::numeric_limits<double>::infinity();
        Primitive which = 0;
        std::size_t n_near = 0; // for the blend
        for (const Operand& o : operands_) {
            const Nearest d = o.probe->at(p);
            const double v = o.sign * d.value_m;
            n_near += v < least + blend_m_;
            if (v < least) {
                least = v;
                which = o.first + d.primitive;
            }
        }
        if (blend_m_ > 0 && n_near > 1)
            if (const double blended = blended_at(p); blended < least)
                return {sign_ * blended, own_};
        return {sign_ * least, which};
    }

    Value of(Primitive primitive, const Vec3& p) const override {
        if (primitive == own_)
            return blended_slope(p, gradient_step(reach_m_));
        const Operand& o = owner(primitive);
        return times(sign_ * o.sign, o.probe->of(primitive - o.first, p));
    }

    double value_of(Primitive primitive, const Vec3& p) const override {
        if (primitive == own_)
            return sign_ * blended_at(p);
        const Operand& o = owner(primitive);
        return sign_ * o.sign * o.probe->value_of(primitive - o.first, p);
    }

    Value slope(const Vec3& p, double step_m) const override {
        if (blend_m_ > 0)
            return blended_slope(p, step_m);
        const Operand* least = nullptr;
        double least_m = std::numeric_limits<double>::infinity();
        for (const Operand& o : operands_)
            if (const double v = o.sign * o.probe->at(p).value_m; v < least_m) {
                least = &o;
                least_m = v;
            }
        return times(sign_ * least->sign, least->probe->slope(p, step_m));
    }

    void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const override {
        for (const Operand& o : operands_) {
            const std::size_t begin = out.size();
            o.probe->near(p, reach_m, out);
            for (std::size_t i = begin; i < out.size(); ++i)
                out[i] += o.first;
        }
        if (blend_m_ > 0 && std::fabs(at(p).value_m) <= reach_m)
            out.push_back(own_);
    }

    std::optional<Sphere> ball(Primitive primitive) const override {
        if (primitive == own_)
            return std::nullopt;
        const Operand& o = owner(primitive);
        return o.probe->ball(primitive - o.first);
    }

private:
    static Value times(double sign, Value v) {
        v.value_m *= sign;
        v.gradient *= sign;
        return v;
    }
    const Operand& owner(Primitive primitive) const {
        return *(std::upper_bound(operands_.begin(), operands_.end(), primitive,
                                  [](Primitive p, const Operand& o) { return p < o.first; }) -
                 1);
    }
    /// The least of the operands' values, blended.
    double blended_at(const Vec3& p) const {
        boost::container::small_vector<double, kFew> values;
        for (const Operand& o : operands_)
            values.push_back(o.sign * o.probe->at(p).value_m);
        std::sort(values.begin(), values.end());
        return smooth_min_sorted({values.data(), values.size()}, blend_m_);
    }
    /// sign * blended_at(), by the chain rule.
    Value blended_slope(const Vec3& p, double step_m) const {
        boost::container::small_vector<std::pair<double, const Operand*>, kFew> order;
        for (const Operand& o : operands_)
            order.push_back({o.sign * o.probe->at(p).value_m, &o});
        std::stable_sort(order.begin(), order.end(),
                         [](const auto& a, const auto& b) { return a.first < b.first; });
        boost::container::small_vector<double, kFew> values, weights(order.size());
        for (const auto& [value, o] : order)
            values.push_back(value);
        const std::span<const double> sorted{values.data(), values.size()};
        smooth_min_weights(sorted, blend_m_, {weights.data(), weights.size()});
        Value blended{sign_ * smooth_min_sorted(sorted, blend_m_), {}};
        for (std::size_t i = 0; i < order.size() && weights[i] > 0; ++i)
            blended.gradient += order[i].second->probe->slope(p, step_m).gradient *
                                (sign_ * order[i].second->sign * weights[i]);
        return blended;
    }

    static constexpr std::size_t kFew = 8;
    double sign_, blend_m_, reach_m_;
    std::vector<Operand> operands_;
    Primitive own_;
};

} // namespace

Primitive CombineField::n_primitives() const {
    Primitive n = blend_m_ > 0 ? 1 : 0;
    for (const auto& f : of_)
        n += f->n_primitives();
    return n;
}

std::unique_ptr<FieldProbe> CombineField::probe(const Box& region_m, double reach_m) const {
    std::vector<Operand> operands;
    Primitive n = 0;
    for (std::size_t i = 0; i < of_.size(); ++i) {
        const bool holds = how_ == Combine::intersect || (how_ == Combine::subtract && i == 0);
        // Differences of the blend look a step farther.
        const double margin = blend_m_ > 0 ? 2 * gradient_step(reach_m) : 0;
        operands.push_back({of_[i]->probe(region_m.dilated(margin), reach_m + blend_m_ + margin),
                            holds ? -1.0 : 1.0, n});
        n += of_[i]->n_primitives();
    }
    return std::make_unique<CombineProbe>(how_ == Combine::unite ? 1.0 : -1.0, blend_m_, reach_m,
                                          std::move(operands), n);
}

Primitive DifferenceField::n_primitives() const {
    return a_->n_primitives() + b_->n_primitives();
}

std::unique_ptr<FieldProbe> DifferenceField::probe(const Box& region_m, double reach_m) const {
    std::vector<Operand> operands;
    operands.push_back({a_->probe(region_m, reach_m), -1.0, 0});
    operands.push_back({b_->probe(region_m, reach_m), 1.0, a_->n_primitives()});
    return std::make_unique<CombineProbe>(-1.0, 0, reach_m, std::move(operands), n_primitives());
}

} // namespace taihu
