#!/bin/sh
# The pictures of the page docs/src/model-gallery.md, made of models that are not in the repository.
#
#   sh docs/model-gallery.sh MODELS [PICTURES]
#
# MODELS is a folder that holds, anywhere below it, the files named here: those of Khronos's glTF-Sample-Assets, and
# spot.obj. PICTURES is where pictures go, docs/src/pictures unless said. `FIRSTLIGHT` names the program.
set -eu
models=$1
pictures=${2:-$(dirname "$0")/src/pictures}
program=${FIRSTLIGHT:-firstlight}
failed=0

# picture NAME FILE [OPTIONS...]
picture() {
  name=$1 file=$2
  shift 2
  found=$(find "$models" -name "$file" -not -path '*Draco*' | sort | head -n 1)
  if [ -z "$found" ]; then
    echo "$file: not below $models" >&2
    failed=1
    return
  fi
  "$program" render "$found" --quiet "$@" -o "$pictures/model-$name.png" || failed=1
}

picture sofa GlamVelvetSofa.glb --variant 'Pale Pink' --size 400
picture sofa-navy GlamVelvetSofa.glb --variant Navy --view -35,12 --size 400
picture spot spot.obj --view 150,15 --studio clay --size 400
picture spheres MetalRoughSpheresNoTextures.gltf --view 20,10 --size 400
picture coat ClearCoatTest.glb --view front --size 500x500
picture alpha AlphaBlendModeTest.glb --view 15,12 --size 800x300
picture boxes SimpleInstancing.glb --size 400
picture trees RecursiveSkeletons.glb --time 0.3 --view 25,25 --margin 0.1 --size 400
picture orientation OrientationTest.gltf --studio hard --size 400
exit $failed
