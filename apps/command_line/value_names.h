#pragma once

namespace CLI {
class App;
}

namespace flash {

/// Says in the help of every verb what stands for a value, as FOLDER or NAME=VALUE in place of TEXT.
void name_values(CLI::App& app);

}  // namespace flash
