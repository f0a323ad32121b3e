// What the fuzzers and the replay run: each reader on bytes that it must not believe. A result that
// breaks a reader's promises aborts, so that it is found like a crash.
#pragma once

#include <string_view>

namespace keratin::fuzz {

void run_alembic(std::string_view bytes);
void run_cache(std::string_view bytes);
void run_gltf(std::string_view bytes);
void run_hair(std::string_view bytes);
void run_obj_curves(std::string_view bytes);
void run_obj_mesh(std::string_view bytes);
void run_open_asset(std::string_view bytes);
void run_poses(std::string_view text);
void run_recipe(std::string_view text);
void run_rod_asset(std::string_view bytes);
void run_saved_run(std::string_view bytes);
void run_scene(std::string_view text);
void run_step_asset(std::string_view bytes);
void run_tfx(std::string_view bytes);
void run_tfxbone(std::string_view bytes);
void run_tfxskin(std::string_view bytes);
void run_usc_data(std::string_view bytes);

}  // namespace keratin::fuzz
