// The program `taihu-reader`: reads what comes from elsewhere for `taihu`, under tight limits.
#include <tbb/global_control.h>

#include "mesh_out/io/foreign_formats_detail.h"
#include "stats/core/foreign.h"
#include "vdb_ops/foreign_vdb_detail.h"

int main(int argc, char** argv) {
    const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
    return taihu::serve_foreign(
        argc, argv,
        {{"draco", taihu::flat_draco}, {"exr", taihu::flat_exr}, {"vdb", taihu::flat_vdb}});
}
