#include <cmath>

#include "vdb_ops/offset_field.h"
#include "vdb_ops/probe_detail.h"

namespace taihu {
namespace {

/// sign * (distance of another - by). Its primitives are those of the other, shifted, then one of
/// its own: where the distance is not that of the primitive that decides, as past an edge of a box,
/// the shifted field itself is smooth.
class ShiftedProbe final : public FieldProbe {
public:
    ShiftedProbe(std::unique_ptr<FieldProbe> of, Primitive n, double sign, double by_m,
                 double reach_m)
        : of_(std::move(of)), own_(n), sign_(sign), by_m_(by_m), reach_m_(reach_m) {}

    Nearest at(const Vec3& p) const override {
        const Nearest d = of_->at(p);
        const double v = sign_ * (d.value_m - by_m_);
        const bool far = std::fabs(v) >= reach_m_;
        if (!far && by_m_ != 0 &&
            std::fabs(of_->value_of(d.primitive, p) - d.value_m) > 1e-6 * reach_m_)
            return {v, own_};
        return {v, d.primitive};
    }
    Value of(Primitive primitive, const Vec3& p) const override {
        return shifted(primitive == own_ ? of_->slope(p, gradient_step(reach_m_))
                                         : of_->of(primitive, p));
    }
    double value_of(Primitive primitive, const Vec3& p) const override {
        return sign_ *
               ((primitive == own_ ? of_->at(p).value_m : of_->value_of(primitive, p)) - by_m_);
    }
    Value slope(const Vec3& p, double step_m) const override {
        return shifted(of_->slope(p, step_m));
    }
    void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const override {
        const std::size_t begin = out.size();
        of_->near(p, reach_m + std::fabs(by_m_), out);
        const auto far = [&](Primitive i) { return std::fabs(value_of(i, p)) > reach_m; };
        out.erase(std::remove_if(out.begin() + static_cast<std::ptrdiff_t>(begin), out.end(), far),
                  out.end());
        if (by_m_ != 0 && std::fabs(at(p).value_m) <= reach_m)
            out.push_back(own_);
    }
    std::optional<Sphere> ball(Primitive primitive) const override {
        auto ball = primitive == own_ ? std::nullopt : of_->ball(primitive);
        if (!ball || by_m_ == 0)
            return ball;
        // Whether it is the ball's outside or inside that counts, a point of its surface tells.
        const Vec3 top = ball->center + Vec3{0, 2 * ball->radius_m, 0};
        ball->radius_m += of_->of(primitive, top).value_m > 0 ? by_m_ : -by_m_;
        if (!(ball->radius_m > 0))
            return std::nullopt;
        return ball;
    }

private:
    Value shifted(Value v) const {
        v.value_m = sign_ * (v.value_m - by_m_);
        v.gradient *= sign_;
        return v;
    }

    std::unique_ptr<FieldProbe> of_;
    Primitive own_;
    double sign_, by_m_, reach_m_;
};

std::unique_ptr<FieldProbe> shifted(const Field& of, double sign, double by_m, const Box& region_m,
                                    double reach_m) {
    const double margin = 2 * gradient_step(reach_m);
    return std::make_unique<ShiftedProbe>(
        of.probe(region_m.dilated(margin), reach_m + std::fabs(by_m) + margin), of.n_primitives(),
        sign, by_m, reach_m);
}

/// The greater of two.
class WallProbe final : public FieldProbe {
public:
    WallProbe(std::unique_ptr<FieldProbe> outer, std::unique_ptr<FieldProbe> inner, Primitive n)
        : outer_(std::move(outer)), inner_(std::move(inner)), n_outer_(n) {}

    Nearest at(const Vec3& p) const override {
        const Nearest a = outer_->at(p), b = inner_->at(p);
        return a.value_m >= b.value_m ? a : Nearest{b.value_m, n_outer_ + b.primitive};
    }
    Value of(Primitive i, const Vec3& p) const override {
        return i < n_outer_ ? outer_->of(i, p) : inner_->of(i - n_outer_, p);
    }
    double value_of(Primitive i, const Vec3& p) const override {
        return i < n_outer_ ? outer_->value_of(i, p) : inner_->value_of(i - n_outer_, p);
    }
    Value slope(const Vec3& p, double step_m) const override {
        return (outer_->at(p).value_m >= inner_->at(p).value_m ? outer_ : inner_)->slope(p, step_m);
    }
    void near(const Vec3& p, double reach_m, std::vector<Primitive>& out) const override {
        outer_->near(p, reach_m, out);
        const std::size_t begin = out.size();
        inner_->near(p, reach_m, out);
        for (std::size_t i = begin; i < out.size(); ++i)
            out[i] += n_outer_;
    }
    std::optional<Sphere> ball(Primitive i) const override {
        return i < n_outer_ ? outer_->ball(i) : inner_->ball(i - n_outer_);
    }

private:
    std::unique_ptr<FieldProbe> outer_, inner_;
    Primitive n_outer_;
};

} // namespace

Primitive OffsetField::n_primitives() const {
    return of_->n_primitives() + 1;
}

std::unique_ptr<FieldProbe> OffsetField::probe(const Box& region_m, double reach_m) const {
    return shifted(*of_, 1, by_m_, region_m, reach_m);
}

Primitive ShellField::n_primitives() const {
    return 2 * (of_->n_primitives() + 1);
}

std::unique_ptr<FieldProbe> ShellField::probe(const Box& region_m, double reach_m) const {
    return std::make_unique<WallProbe>(shifted(*of_, 1, outwards_m_, region_m, reach_m),
                                       shifted(*of_, -1, -inwards_m_, region_m, reach_m),
                                       of_->n_primitives() + 1);
}

Primitive ComplementField::n_primitives() const {
    return of_->n_primitives() + 1;
}

std::unique_ptr<FieldProbe> ComplementField::probe(const Box& region_m, double reach_m) const {
    return shifted(*of_, -1, 0, region_m, reach_m);
}

} // namespace taihu
