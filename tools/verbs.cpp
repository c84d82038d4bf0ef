#include "tools/verbs.h"

#include "stats/core/error.h"

namespace taihu {

void add_verbs(CLI::App& app, Console& console) {
    add_fit(app, console);
    add_sample(app, console);
    add_shape(app, console);
    add_voxelize(app, console);
    add_carve(app, console);
    add_rock(app, console);
    add_mesh(app, console);
    add_lod(app, console);
    add_bake(app, console);
    add_check(app, console);
    add_measure(app, console);
    add_section(app, console);
    add_relief(app, console);
    add_render(app, console);
    add_gallery(app, console);
    add_info(app, console);
}

nlohmann::ordered_json run_command(const std::string& command, Progress* progress) {
    nlohmann::ordered_json result;
    Console console;
    console.json = console.quiet = true;
    console.progress = progress;
    console.sink = &result;
    CLI::App app("", "taihu");
    app.require_subcommand(1);
    add_verbs(app, console);
    try {
        app.parse(command, true);
    } catch (const CLI::RuntimeError&) {
        throw Error(Fault::bad_input, "the verb says no");
    } catch (const CLI::ParseError& e) {
        throw Error(Fault::bad_argument, e.what());
    }
    return result;
}

} // namespace taihu
