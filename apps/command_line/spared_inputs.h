#pragma once

namespace CLI {
class App;
}

namespace flash {

/// Before a verb of a parsed command line begins: throws data::InputError where a result would take the place
/// of what the verb reads, --force or not. Read are the files that options name, the files which those name
/// (the meshes of an asset or a scene, all of a recording), the frames of a folder and the tables, the answer
/// and the motions of a search. A file to write is none of them, whatever links and folders lead there, and
/// no input of other runs (input_there), but for an asset that export writes again; a folder to write that is
/// there already holds none of them, but for --resume, which adds to it, and no other run writes there.
void expect_spared_inputs(const CLI::App& app);

}  // namespace flash
