"""Bakes hair in a Bazel build.

    load("//tools/bazel:keratin_bake.bzl", "keratin_bake")

    keratin_bake(
        name = "head",
        recipe = "head.json",
        srcs = ["hair/front.abc", "hair/back.abc", "head.obj"],
    )

bakes head.json into head.kera. Bazel runs the program where only declared files exist, so `srcs` names
every file that the recipe names (and what those name: .mtl files, glTF buffers); a file that is
forgotten is a file that cannot be opened, by name. `keratin-bake RECIPE -o x.kera --depfile x.d` lists
them. Assets hold no path, time or host name, so they can be cached and shared.

The program is `@keratin//:bin/keratin-bake` unless `program` says otherwise: an installed keratin is
made known to a WORKSPACE by

    new_local_repository(
        name = "keratin",
        path = "/usr/local",
        build_file_content = "exports_files([\\"bin/keratin-bake\\"])",
    )
"""

def _keratin_bake_impl(ctx):
    asset = ctx.outputs.out
    if not asset:
        asset = ctx.actions.declare_file(ctx.label.name + ".kera")
    arguments = ctx.actions.args()
    arguments.add(ctx.file.recipe)
    arguments.add("-o", asset)
    arguments.add("--quiet")
    arguments.add("--threads", str(ctx.attr.threads))
    if ctx.attr.strict:
        arguments.add("--strict")
    ctx.actions.run(
        executable = ctx.executable.program,
        arguments = [arguments],
        inputs = [ctx.file.recipe] + ctx.files.srcs,
        outputs = [asset],
        mnemonic = "KeratinBake",
        progress_message = "Baking %s" % asset.short_path,
    )
    return [DefaultInfo(files = depset([asset]), runfiles = ctx.runfiles(files = [asset]))]

keratin_bake = rule(
    implementation = _keratin_bake_impl,
    doc = "Bakes a groom recipe and the files it names into one asset.",
    attrs = {
        "recipe": attr.label(mandatory = True, allow_single_file = [".json"], doc = "The recipe."),
        "srcs": attr.label_list(allow_files = True, doc = "Every file the recipe names: curves, mesh, bones."),
        "out": attr.output(doc = "The asset; by default the rule's name with .kera."),
        "strict": attr.bool(default = False, doc = "Refuse unusable strands instead of leaving them out."),
        "threads": attr.int(default = 1, doc = "Threads of one bake; the asset is the same for any number."),
        "program": attr.label(
            default = "@keratin//:bin/keratin-bake",
            executable = True,
            allow_single_file = True,
            cfg = "exec",
            doc = "keratin-bake.",
        ),
    },
)
