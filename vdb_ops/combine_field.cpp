#include "vdb_ops/combine_field.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "stats/core/error.h"
#include "stats/number_detail.h"
#include "vdb_ops/kernels_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
constexpr double kMostBlend_vox = 1000;

// All three are one: union is the minimum of the distances, intersection the negated minimum of
// the negated ones, difference the negated minimum of -a, b, c... Negation is exact.

Cover flipped(Cover c) {
    return c == Cover::outside ? Cover::inside : c == Cover::inside ? Cover::outside : c;
}
Cover times(float sign, Cover c) {
    return sign < 0 ? flipped(c) : c;
}

/// Weight i of the sorted values [first, last) is (level - u_i) / k before `end`, u_i being the
/// value above the least, and 0 from there on.
struct Blend {
    double level;
    const double* end;
};
Blend blend_of(const double* first, const double* last, double k) {
    const double least = *first;
    double sum = 0, level = k;
    const double* end = first;
    for (double n = 1; end != last && *end - least < level; ++n) {
        sum += *end++ - least;
        level = (k + sum) / n;
    }
    return {level, end};
}

/// Minimum of the sorted values [first, last) over k, relative to the first.
double blend_sorted(const double* first, const double* last, double k) {
    const double least = *first;
    const auto [level, end] = blend_of(first, last, k);
    if (end - first == 1)
        return least;
    if (end - first == 2) {
        const double rest = k - (first[1] - least);
        return least - rest * rest / (4 * k);
    }
    double squares = 0;
    for (const double* v = first; v != end; ++v)
        squares += (level - (*v - least)) * (level - (*v - least));
    return least + level - k / 2 - squares / (2 * k);
}

TAIHU_CLONES
void min_values(const float* values, float sign, float* out) {
    for (int i = 0; i < 512; ++i)
        out[i] = std::min(out[i], sign * values[i]);
}

TAIHU_CLONES
void blend_two(const float* a, const float* b, double k, float* out) {
    for (int i = 0; i < 512; ++i) {
        const double rest =
            std::max(k - std::fabs(static_cast<double>(a[i]) - static_cast<double>(b[i])), 0.0);
        out[i] = static_cast<float>(std::min(a[i], b[i]) - rest * rest / (4 * k));
    }
}

/// Of n leaves of values, one after the other.
void blend_many(const std::vector<float>& values, double k, float* out) {
    std::vector<double> near;
    for (std::size_t i = 0; i < 512; ++i) {
        float least = values[i];
        for (std::size_t v = i; v < values.size(); v += 512)
            least = std::min(least, values[v]);
        near.clear();
        for (std::size_t v = i; v < values.size(); v += 512)
            if (static_cast<double>(values[v]) - static_cast<double>(least) < k)
                near.push_back(static_cast<double>(values[v]));
        std::sort(near.begin(), near.end());
        out[i] = static_cast<float>(blend_sorted(near.data(), near.data() + near.size(), k));
    }
}

/// An operand in a block: on the band that is asked for, and on the wider one for blending.
struct OpenOperand {
    float sign;
    std::unique_ptr<BlockSampler> narrow, wide;
    Cover narrow_whole = Cover::surface; ///< of the block, without a narrow sampler

    Cover cover(const Coord& leaf) const {
        return times(sign, (wide ? wide : narrow)->cover(leaf));
    }
    Cover narrow_cover(const Coord& leaf) const {
        return narrow ? times(sign, narrow->cover(leaf)) : narrow_whole;
    }
};

/// How operands become a result: out = sign * min(sign_i * d_i), blended over `blend` voxels.
struct Rule {
    float sign = 1, half_width = 3;
    double blend = 0;
};

class CombineBlock final : public BlockSampler {
public:
    CombineBlock(const Rule& rule, std::vector<OpenOperand> operands)
        : rule_(rule), operands_(std::move(operands)) {}

    Cover cover(const Coord& leaf) const override {
        const OpenOperand* last = nullptr;
        int n = 0;
        for (const OpenOperand& o : operands_) {
            const Cover c = o.cover(leaf);
            if (c == Cover::outside)
                continue;
            if (c == Cover::inside || (o.wide && o.narrow_cover(leaf) == Cover::inside))
                return times(rule_.sign, Cover::inside);
            last = &o;
            ++n;
        }
        if (n > 1)
            return Cover::surface;
        return times(rule_.sign, n == 0 ? Cover::outside : last->narrow_cover(leaf));
    }

    void values(const Coord& leaf, float* out) override {
        near_.clear();
        for (OpenOperand& o : operands_)
            if (o.cover(leaf) != Cover::outside)
                near_.push_back(&o);
        if (near_.size() > 1 && rule_.blend > 0)
            blend(leaf, out);
        else
            least(leaf, out);
        const float w = rule_.half_width;
        for (int i = 0; i < 512; ++i) // -0 or +0 must not depend on the order
            out[i] = rule_.sign * std::clamp(out[i], -w, w) + 0.f;
    }

private:
    void least(const Coord& leaf, float* out) {
        alignas(64) float one[512];
        std::fill(out, out + 512, rule_.half_width);
        for (OpenOperand* o : near_) {
            o->narrow->values(leaf, one);
            min_values(one, o->sign, out);
        }
    }

    void blend(const Coord& leaf, float* out) {
        values_.resize(near_.size() * 512);
        float* next = values_.data();
        for (OpenOperand* o : near_) {
            o->wide->values(leaf, next);
            for (int i = 0; i < 512; ++i)
                next[i] *= o->sign;
            next += 512;
        }
        if (near_.size() == 2)
            blend_two(values_.data(), values_.data() + 512, rule_.blend, out);
        else
            blend_many(values_, rule_.blend, out);
    }

    Rule rule_;
    std::vector<OpenOperand> operands_;
    std::vector<OpenOperand*> near_;
    std::vector<float> values_;
};

struct Operand {
    float sign;
    std::unique_ptr<LatticeField> narrow, wide; ///< `wide` only for blending
    CoordBBox reach;                            ///< outside of it the operand is far outside
};

class LatticeCombine final : public LatticeField {
public:
    LatticeCombine(const Rule& rule, std::vector<Operand> operands, const CoordBBox& box)
        : rule_(rule), operands_(std::move(operands)), box_(box) {}

    CoordBBox bounds() const override { return box_; }

    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        const CoordBBox voxels = CoordBBox::createCube(block, BlockSampler::kBlock);
        const auto meets = [&](const Operand& o) { return o.reach.hasOverlap(voxels); };
        std::vector<OpenOperand> near;
        cover = times(rule_.sign, Cover::inside);
        for (const Operand& o : operands_)
            if (o.sign < 0 && !meets(o))
                return nullptr;
        // From the last: where holes cover a block, what they are cut from is not opened.
        for (auto o = operands_.rbegin(); o != operands_.rend(); ++o) {
            OpenOperand open{o->sign, nullptr, nullptr};
            Cover c = Cover::outside;
            auto sampler = meets(*o) ? (o->wide ? o->wide : o->narrow)->open(block, c) : nullptr;
            if (sampler && o->wide) {
                open.wide = std::move(sampler);
                open.narrow = o->narrow->open(block, c);
                if (!open.narrow && (open.narrow_whole = times(o->sign, c)) == Cover::inside)
                    return nullptr;
            } else if (sampler) {
                open.narrow = std::move(sampler);
            } else if (times(o->sign, c) == Cover::inside) {
                return nullptr;
            } else {
                continue;
            }
            near.push_back(std::move(open));
        }
        if (near.empty() || (near.size() == 1 && !near[0].narrow)) {
            cover = times(rule_.sign, Cover::outside);
            return nullptr;
        }
        cover = Cover::surface;
        return std::make_unique<CombineBlock>(rule_, std::move(near));
    }

private:
    Rule rule_;
    std::vector<Operand> operands_;
    CoordBBox box_;
};

} // namespace

CombineField::CombineField(Combine how, std::vector<std::shared_ptr<const Field>> of,
                           double blend_m)
    : how_(how), of_(std::move(of)), blend_m_(blend_m) {
    if (of_.empty())
        throw Error(Fault::bad_argument, "combine: no solids are given; give one at least");
    for (std::size_t i = 0; i < of_.size(); ++i)
        if (!of_[i])
            throw Error(Fault::bad_argument,
                        "combine: of[" + std::to_string(i) + "] is null; give a field");
    if (!(blend_m >= 0) || !std::isfinite(blend_m))
        throw Error(Fault::bad_argument, "combine: blend_m is " + shortest(blend_m) +
                                             ", must be finite and >= 0; 0 keeps seams sharp");
}

std::unique_ptr<LatticeField> CombineField::on(const Lattice& lattice,
                                               const CoordBBox& region) const {
    Rule rule{how_ == Combine::unite ? 1.f : -1.f, lattice.half_width_vox,
              blend_m_ / lattice.voxel_m};
    if (rule.blend > kMostBlend_vox)
        throw Error(Fault::bad_argument, "combine: blend_m is " + shortest(blend_m_) + ", " +
                                             rounded(rule.blend) +
                                             " voxels, must be at most 1000; blend less, or use a "
                                             "larger voxel");
    Lattice wide = lattice;
    wide.half_width_vox += static_cast<float>(rule.blend);
    std::vector<Operand> operands;
    CoordBBox box, rest = region; // outside of what must hold it nothing counts
    for (std::size_t i = 0; i < of_.size(); ++i) {
        const bool holds = how_ == Combine::intersect || (how_ == Combine::subtract && i == 0);
        Operand o{holds ? -1.f : 1.f, of_[i]->on(lattice, rest), nullptr, {}};
        if (rule.blend > 0)
            o.wide = of_[i]->on(wide, rest);
        o.reach = (o.wide ? o.wide : o.narrow)->bounds();
        if (holds) {
            rest.intersect(o.narrow->bounds());
            if (i == 0)
                box = o.narrow->bounds();
            box.intersect(o.narrow->bounds());
        } else if (how_ == Combine::unite) {
            box.expand(o.reach);
        }
        operands.push_back(std::move(o));
    }
    return std::make_unique<LatticeCombine>(rule, std::move(operands), box);
}

double smooth_min(std::vector<double> values, double k) {
    std::sort(values.begin(), values.end());
    return smooth_min_sorted(values, k);
}

double smooth_min_sorted(std::span<const double> values, double k) {
    return k > 0 ? blend_sorted(values.data(), values.data() + values.size(), k) : values.front();
}

void smooth_min_weights(std::span<const double> values, double k, std::span<double> weights) {
    const double* const first = values.data();
    const auto [level, end] = blend_of(first, first + values.size(), k);
    for (std::size_t i = 0; i < values.size(); ++i)
        weights[i] = first + i < end ? (level - (values[i] - values[0])) / k : 0;
}

} // namespace taihu
