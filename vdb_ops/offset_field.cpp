#include "vdb_ops/offset_field.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "stats/core/error.h"
#include "stats/number_detail.h"

namespace taihu {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
constexpr double kMost_vox = 1000;
constexpr int kFar = 1 << 30; // rasterize() refuses what reaches beyond

/// A function of a distance in voxels, and what it makes of far away.
struct Offset {
    float by;
    float operator()(float d) const { return d - by; }
    Cover operator()(Cover c) const { return c; }
};
struct Shell {
    float in, out;
    float operator()(float d) const { return std::max(d - out, -in - d); }
    Cover operator()(Cover c) const { return c == Cover::surface ? c : Cover::outside; }
};
struct Complement {
    float operator()(float d) const { return 0.f - d; } // never -0
    Cover operator()(Cover c) const {
        return c == Cover::outside ? Cover::inside : c == Cover::inside ? Cover::outside : c;
    }
};

template <class Map>
class MappedBlock final : public BlockSampler {
public:
    MappedBlock(std::unique_ptr<BlockSampler> of, const Map& map, float half_width)
        : of_(std::move(of)), map_(map), half_width_(half_width) {}

    Cover cover(const Coord& leaf) const override { return map_(of_->cover(leaf)); }
    void values(const Coord& leaf, float* out) override {
        of_->values(leaf, out);
        for (int i = 0; i < 512; ++i)
            out[i] = std::clamp(map_(out[i]), -half_width_, half_width_);
    }

private:
    std::unique_ptr<BlockSampler> of_;
    Map map_;
    float half_width_;
};

template <class Map>
class LatticeMapped final : public LatticeField {
public:
    LatticeMapped(std::unique_ptr<LatticeField> of, const Map& map, const CoordBBox& box,
                  float half_width)
        : of_(std::move(of)), map_(map), box_(box), half_width_(half_width) {}

    CoordBBox bounds() const override { return box_; }
    std::unique_ptr<BlockSampler> open(const Coord& block, Cover& cover) const override {
        auto of = of_->open(block, cover);
        cover = of ? Cover::surface : map_(cover);
        if (!of)
            return nullptr;
        return std::make_unique<MappedBlock<Map>>(std::move(of), map_, half_width_);
    }

private:
    std::unique_ptr<LatticeField> of_;
    Map map_;
    CoordBBox box_;
    float half_width_;
};

void check_field(const std::shared_ptr<const Field>& of, const char* where) {
    if (!of)
        throw Error(Fault::bad_argument,
                    std::string(where) + ": the field is null; give what it is made of");
}

void check_distance(double m, const char* where) {
    if (!(m >= 0) || !std::isfinite(m))
        throw Error(Fault::bad_argument, std::string(where) + ": the distance is " + shortest(m) +
                                             ", must be finite and >= 0; give a length in metres");
}

/// `m` in voxels, and the lattice whose band is wider by it.
float widen(Lattice& lattice, double m, const char* where) {
    const double vox = m / lattice.voxel_m;
    if (vox > kMost_vox)
        throw Error(Fault::bad_argument, std::string(where) + ": the distance is " + rounded(vox) +
                                             " voxels, must be at most 1000; use a larger voxel");
    lattice.half_width_vox += static_cast<float>(vox);
    return static_cast<float>(vox);
}

template <class Map>
std::unique_ptr<LatticeField> mapped(const Field& of, const Map& map, const Lattice& wide,
                                     const CoordBBox& region, float half_width) {
    auto child = of.on(wide, region);
    const CoordBBox box = child->bounds();
    return std::make_unique<LatticeMapped<Map>>(std::move(child), map, box, half_width);
}

} // namespace

OffsetField::OffsetField(std::shared_ptr<const Field> of, double by_m)
    : of_(std::move(of)), by_m_(by_m) {
    check_field(of_, "offset");
    check_distance(std::fabs(by_m), "offset");
}

std::unique_ptr<LatticeField> OffsetField::on(const Lattice& lattice,
                                              const CoordBBox& region) const {
    Lattice wide = lattice;
    const float by = widen(wide, std::fabs(by_m_), "offset");
    return mapped(*of_, Offset{by_m_ < 0 ? -by : by}, wide, region, lattice.half_width_vox);
}

ShellField::ShellField(std::shared_ptr<const Field> of, double inwards_m, double outwards_m)
    : of_(std::move(of)), inwards_m_(inwards_m), outwards_m_(outwards_m) {
    check_field(of_, "shell");
    check_distance(inwards_m, "shell");
    check_distance(outwards_m, "shell");
    if (inwards_m == 0 && outwards_m == 0)
        throw Error(Fault::bad_argument, "shell: it has no thickness; give one above 0");
}

std::unique_ptr<LatticeField> ShellField::on(const Lattice& lattice,
                                             const CoordBBox& region) const {
    Lattice wide = lattice;
    widen(wide, std::max(inwards_m_, outwards_m_), "shell");
    return mapped(*of_,
                  Shell{static_cast<float>(inwards_m_ / lattice.voxel_m),
                        static_cast<float>(outwards_m_ / lattice.voxel_m)},
                  wide, region, lattice.half_width_vox);
}

ComplementField::ComplementField(std::shared_ptr<const Field> of) : of_(std::move(of)) {
    check_field(of_, "complement");
}

std::unique_ptr<LatticeField> ComplementField::on(const Lattice& lattice,
                                                  const CoordBBox& region) const {
    const CoordBBox everywhere(Coord(-kFar - 1), Coord(kFar + 1));
    return std::make_unique<LatticeMapped<Complement>>(of_->on(lattice, region), Complement{},
                                                       everywhere, lattice.half_width_vox);
}

} // namespace taihu
