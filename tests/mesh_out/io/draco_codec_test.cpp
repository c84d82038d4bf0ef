#include <algorithm>
#include <set>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mesh_out/io/draco_codec_detail.h"
#include "mesh_out/io/glb.h"
#include "stats/core/error.h"
#include "stats/core/rng.h"
#include "tests/mesh_out/io/grid_ball.h"

namespace taihu {
namespace {

const TriMesh kBall = grid_ball(12, 1, 0x1p-8);
const PositionGrid kGrid = centred_grid(0x1p-8, 10);

std::multiset<std::tuple<float, float, float>> float_positions(const TriMesh& mesh) {
    std::multiset<std::tuple<float, float, float>> out;
    for (const Vec3& p : mesh.positions)
        out.emplace(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    return out;
}

TEST(EncodeDraco, KeepsEveryPositionBitForBit) {
    for (const double step : {0x1p-20, 0x1p-8, 0x1p0, 0x1p10})
        for (const int bits : {8, 13, 18}) {
            // As large as the grid allows, and off centre, so that every bit is used.
            const double radius = step * (std::ldexp(1.0, bits - 1) - 1);
            TriMesh ball = grid_ball(12, radius, step);
            PositionGrid grid = centred_grid(step, bits);
            const Vec3 shift = Vec3{5, -17, 33} * step;
            grid.origin += shift;
            for (Vec3& p : ball.positions)
                p += shift;
            const EncodedLevel level = encode_draco(ball, grid);
            EXPECT_EQ(float_positions(level.decoded), float_positions(ball));
            EXPECT_EQ(level.decoded.triangles.size(), ball.triangles.size());
            // The order of the sum differs: some 1000 terms of rounding 1e-16.
            EXPECT_NEAR(signed_volume_m3(level.decoded) / signed_volume_m3(ball), 1, 1e-12);
        }
}

TEST(EncodeDraco, SharesPointsBetweenMeshesOnOneGrid) {
    TriMesh half = kBall, other = kBall;
    const auto above = [](const TriMesh& mesh, const Triangle& t) {
        return std::all_of(t.begin(), t.end(), [&](auto i) { return mesh.positions[i].y >= 0; });
    };
    const auto keep = [&](TriMesh& mesh, bool upper) {
        std::erase_if(mesh.triangles, [&](const Triangle& t) { return above(mesh, t) != upper; });
        TriMesh used;
        std::map<std::uint32_t, std::uint32_t> renumbered;
        for (Triangle& t : mesh.triangles)
            for (std::uint32_t& corner : t) {
                const auto [at, is_new] = renumbered.try_emplace(
                    corner, static_cast<std::uint32_t>(used.positions.size()));
                if (is_new)
                    used.positions.push_back(mesh.positions[corner]);
                corner = at->second;
            }
        used.triangles = mesh.triangles;
        mesh = used;
    };
    keep(half, true);
    keep(other, false);
    const auto a = float_positions(encode_draco(half, kGrid).decoded);
    const auto b = float_positions(encode_draco(other, kGrid).decoded);
    std::vector<std::tuple<float, float, float>> shared;
    std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(shared));
    EXPECT_EQ(shared.size(), 4u * 12); // the equator
}

TEST(EncodeDraco, KeepsNormalsWithinTenBits) {
    const TriMesh& decoded = encode_draco(kBall, kGrid).decoded;
    ASSERT_EQ(decoded.normals.size(), decoded.positions.size());
    for (std::size_t i = 0; i < decoded.normals.size(); ++i) {
        // An octahedral map of 2^10 cells over 4 sqrt(3) / 3 of arc: under 0.005 rad each way. The
        // position itself was rounded by up to 0.0034.
        const double off = length(decoded.normals[i] - normalized(decoded.positions[i]));
        EXPECT_LT(off, 0.0084);
    }
}

TEST(EncodeDraco, KeepsOpennessAsGreyOfEightBits) {
    for (const bool with_normals : {true, false}) {
        TriMesh mesh = kBall;
        if (!with_normals)
            mesh.normals.clear();
        for (const Vec3& p : mesh.positions)
            mesh.openness.push_back(static_cast<float>(0.5 + 0.5 * p.y / length(p)));
        const TriMesh decoded = encode_draco(mesh, kGrid).decoded;
        ASSERT_EQ(decoded.openness.size(), decoded.positions.size());
        for (std::size_t i = 0; i < decoded.positions.size(); ++i) {
            const Vec3& p = decoded.positions[i];
            EXPECT_NEAR(double(decoded.openness[i]), 0.5 + 0.5 * p.y / length(p), 0.5001 / 255);
        }
    }
}

TEST(EncodeDraco, GivesTheSameBytesAgain) {
    EXPECT_EQ(encode_draco(kBall, kGrid).draco, encode_draco(kBall, kGrid).draco);
    EXPECT_EQ(decode_draco(encode_draco(kBall, kGrid).draco, "rock").positions,
              encode_draco(kBall, kGrid).decoded.positions);
}

TEST(EncodeDraco, UsesTheIdsThatTheGlbNames) {
    const DracoMesh both = decode_draco_mesh(encode_draco(kBall, kGrid).draco, "rock");
    EXPECT_EQ(both.position_id, kDracoPositionId);
    EXPECT_EQ(both.normal_id, kDracoNormalId);
    TriMesh bare = kBall;
    bare.normals.clear();
    EXPECT_FALSE(decode_draco_mesh(encode_draco(bare, kGrid).draco, "rock").normal_id);
}

void expect_encoding_refused(const TriMesh& mesh, const PositionGrid& grid, Fault fault,
                             const std::string& part) {
    try {
        encode_draco(mesh, grid);
        ADD_FAILURE() << "no exception";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), fault) << e.what();
        EXPECT_THAT(e.what(), testing::HasSubstr(part));
    }
}

TEST(EncodeDraco, RefusesPositionsOffTheGrid) {
    TriMesh mesh = kBall;
    mesh.positions[7].y += 0x1p-9;
    expect_encoding_refused(mesh, kGrid, Fault::bad_argument, "positions[7] is not on the grid");
    expect_encoding_refused(kBall, centred_grid(0x1p-8, 8), Fault::bad_argument, "not on the grid");
    expect_encoding_refused(kBall, {{0, 0, 0}, 0.01, 10}, Fault::bad_argument, "power of two");
    expect_encoding_refused(kBall, {{0, 0, 0}, 0x1p-8, 19}, Fault::bad_argument, "1 to 18 bits");
    mesh = kBall; // so far away that float has no room for the step
    for (Vec3& p : mesh.positions)
        p.x += 0x1p20;
    PositionGrid far = kGrid;
    far.origin.x += 0x1p20;
    expect_encoding_refused(mesh, far, Fault::bad_argument, "not on the grid");
}

TEST(EncodeDraco, RefusesWhatDracoWouldChange) {
    TriMesh mesh = kBall;
    mesh.positions.push_back({0, 0, 0}); // no face uses it
    mesh.normals.push_back({0, 1, 0});
    expect_encoding_refused(mesh, kGrid, Fault::numeric, "came back as");
    mesh = kBall;
    mesh.triangles.push_back({0, 1, 1});
    expect_encoding_refused(mesh, kGrid, Fault::numeric, "came back as");
    mesh = kBall;
    mesh.triangles.push_back(mesh.triangles[5]); // edges of three faces
    expect_encoding_refused(mesh, kGrid, Fault::numeric, "encode_draco: ");
}

TEST(DecodeDraco, RefusesEveryShorterStream) {
    const std::string bytes = encode_draco(kBall, kGrid).draco;
    for (std::size_t n = 0; n < bytes.size(); ++n) {
        const std::vector<char> part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
        try {
            decode_draco({part.data(), part.size()}, "rock.drc");
            ADD_FAILURE() << "no exception at " << n;
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::bad_input);
            EXPECT_THAT(e.what(), testing::StartsWith("rock.drc: "));
        }
    }
}

TEST(DecodeDraco, SurvivesChangedBytes) {
    const std::string bytes = encode_draco(kBall, kGrid).draco;
    int n_refused = 0;
    for (std::uint64_t i = 0; i < 2000; ++i) {
        const auto words = Rng{.seed = 11}.words(i);
        std::string changed = bytes;
        // Headers matter most: every other change is in the first 64 bytes.
        changed[words[0] % (words[1] % 2 == 0 ? 64 : bytes.size())] = static_cast<char>(words[2]);
        try {
            const TriMesh mesh = decode_draco(changed, "rock.drc");
            for (const Triangle& t : mesh.triangles)
                for (const std::uint32_t corner : t)
                    ASSERT_LT(corner, mesh.positions.size());
            for (const Vec3& p : mesh.positions)
                ASSERT_TRUE(is_finite(p));
        } catch (const Error& e) {
            EXPECT_EQ(e.fault(), Fault::bad_input);
            ++n_refused;
        }
    }
    EXPECT_GT(n_refused, 100);
}

TEST(DecodeDraco, RefusesMonstrousCountsBeforeAllocating) {
    std::string bytes = encode_draco(kBall, kGrid).draco;
    bytes.replace(12, 2, "\xff\xff\xff\xff\x0f"); // vertices, a varint behind the traversal method
    try {
        decode_draco(bytes, "rock.drc");
        FAIL() << "no exception";
    } catch (const Error& e) {
        EXPECT_THAT(e.what(), testing::HasSubstr("claims 4294967295 faces or vertices"));
    }
}

} // namespace
} // namespace taihu
