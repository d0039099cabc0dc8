// Config 11 for POV-Ray 3.7, for `cargo xtask peers`. Options (command line Declare=NAME=VALUE):
//   LRES   light grid is LRES x LRES (20)     ADAPT  adaptive level, 0 = full grid (0)
//   ILLUM  1: diffuse/specular from every grid point, 0: grid for shadows only (1)
//   POINT  1: one point light in place of the area light (0)
#version 3.7;
global_settings { assumed_gamma 1.0 max_trace_level 1 ambient_light rgb 1 }
#ifndef (LRES)  #declare LRES = 20; #end
#ifndef (ADAPT) #declare ADAPT = 0; #end
#ifndef (ILLUM) #declare ILLUM = 1; #end
#ifndef (POINT) #declare POINT = 0; #end
background { color rgb 0 }
// right -x: right-handed coordinates
camera { location <0,0,10> right -x up y angle 45 look_at <0,0,0> }
light_source {
  <0,5.9,-6> color rgb 1
  #if (!POINT)
    area_light <2,0,0>, <0,0,2>, LRES, LRES
    #if (ADAPT > 0) adaptive ADAPT #end
    #if (ILLUM) area_illumination on #end
  #end
}
// specular/roughness is the Blinn half-vector term with exponent 1/roughness;
// metallic tints the highlight with the surface colour.
#macro Fin(S) finish { ambient 0.1 diffuse 1 specular 1 roughness 1/S metallic } #end
#macro Quad(P, A, B, C)
  polygon { 5, P, P+A, P+A+B, P+B, P  pigment { color C } Fin(16) }
#end
#macro Ball(C, R, C1, C2, N, S)
  sphere { <0,0,0>, R
    pigment {
      function { mod(floor(acos(min(1,max(-1,x/R)))/pi*N) + floor(acos(min(1,max(-1,y/R)))/pi*N), 2) }
      color_map { [0.5 color C1] [0.5 color C2] }
    }
    Fin(S) translate C }
#end
#declare G = rgb 0.7;
Quad(<-10,-10,-10>, <20,0,0>, <0,20,0>, G)
Quad(<-6,-7,-11>, <0,0,20>, <0,20,0>, rgb <1,0,0>)
Quad(<6,-7,-11>, <0,0,20>, <0,20,0>, rgb <0,1,0>)
Quad(<-7,-6,-11>, <20,0,0>, <0,0,20>, G)
Quad(<-7,6,-11>, <20,0,0>, <0,0,20>, G)
Ball(<3,1,-7>, 1.5, rgb <0,0,1>, rgb 1, 4, 22)
Ball(<2,-3.2,-5>, 1.0, rgb <0.2,0.5,0>, rgb <0.9,0,0.4>, 4, 40)
Ball(<-4,2,-5>, 1.8, rgb 1, rgb 0, 8, 120)
Ball(<-2,-4.5,-8>, 2.0, rgb <0.3,1,0.4>, rgb <0.3,0.7,0.2>, 4, 16)
// the lamp as the camera sees it
polygon { 5, <-1,5.9,-7>, <1,5.9,-7>, <1,5.9,-5>, <-1,5.9,-5>, <-1,5.9,-7>
  pigment { color rgb 1 } finish { ambient 1 diffuse 0 } no_shadow }
