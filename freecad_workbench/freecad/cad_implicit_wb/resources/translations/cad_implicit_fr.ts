<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="fr" sourcelanguage="en">
  <context>
    <name>cad_implicit</name>
    <message>
      <source>bound {}</source>
      <translation>borne {}</translation>
    </message>
    <message>
      <source>Validate</source>
      <translation>Valider</translation>
    </message>
    <message>
      <source>Measure the error of a fillet against the exact kernel, and open the report</source>
      <translation>Mesurer l’erreur d’un congé par rapport au noyau exact et ouvrir le rapport</translation>
    </message>
    <message>
      <source>Convert to Solid</source>
      <translation>Convertir en solide</translation>
    </message>
    <message>
      <source>Make a solid of a closed mesh, with triangles in one plane merged</source>
      <translation>Faire un solide d’un maillage fermé, les triangles d’un même plan étant fusionnés</translation>
    </message>
    <message>
      <source>Export</source>
      <translation>Exporter</translation>
    </message>
    <message>
      <source>Write the selected part as STL, 3MF or STEP</source>
      <translation>Écrire la pièce sélectionnée en STL, 3MF ou STEP</translation>
    </message>
    <message>
      <source>{} failed</source>
      <translation>{} a échoué</translation>
    </message>
    <message>
      <source>All edges. Click edges in the 3-D view to work on those only.</source>
      <translation>Toutes les arêtes. Cliquez sur des arêtes dans la vue 3D pour ne traiter que celles-ci.</translation>
    </message>
    <message>
      <source>Remove</source>
      <translation>Retirer</translation>
    </message>
    <message>
      <source>Click faces in the 3-D view that are left open, and again to close them.</source>
      <translation>Cliquez dans la vue 3D sur les faces à laisser ouvertes, et de nouveau pour les fermer.</translation>
    </message>
    <message>
      <source>Click edges in the 3-D view to add them, and again to remove them.</source>
      <translation>Cliquez sur des arêtes dans la vue 3D pour les ajouter, et de nouveau pour les retirer.</translation>
    </message>
    <message>
      <source>Radius of this edge; 0: the one for all.</source>
      <translation>Rayon de cette arête ; 0 : celui de toutes.</translation>
    </message>
    <message>
      <source>Edge</source>
      <translation>Arête</translation>
    </message>
    <message>
      <source>Face</source>
      <translation>Face</translation>
    </message>
    <message>
      <source>Own radius</source>
      <translation>Rayon propre</translation>
    </message>
    <message>
      <source>self-checked error</source>
      <translation>erreur vérifiée</translation>
    </message>
    <message>
      <source>the error of this result is not known</source>
      <translation>l’erreur de ce résultat n’est pas connue</translation>
    </message>
    <message>
      <source>The error of {} could not be measured</source>
      <translation>L’erreur de {} n’a pas pu être mesurée</translation>
    </message>
    <message>
      <source>The solid will have up to {} faces: {}, and {} as a STEP file. Go on?</source>
      <translation>Le solide aura jusqu’à {} faces : {}, et {} en fichier STEP. Continuer ?</translation>
    </message>
    <message>
      <source>{} written</source>
      <translation>{} écrit</translation>
    </message>
    <message>
      <source>Grid: {spacing:.3g} mm, {cells} cells
Memory: {memory}
Time: {seconds}</source>
      <translation>Grille : {spacing:.3g} mm, {cells} cellules
Mémoire : {memory}
Temps : {seconds}</translation>
    </message>
    <message>
      <source>Preview</source>
      <translation>Aperçu</translation>
    </message>
    <message>
      <source>A coarse result, computed after every change</source>
      <translation>Un résultat grossier, calculé après chaque changement</translation>
    </message>
    <message>
      <source>Stop computing</source>
      <translation>Arrêter le calcul</translation>
    </message>
    <message>
      <source>Accuracy</source>
      <translation>Précision</translation>
    </message>
    <message>
      <source>about {:.0f} s</source>
      <translation>environ {:.0f} s</translation>
    </message>
    <message>
      <source>{:.1f} million</source>
      <translation>{:.1f} millions</translation>
    </message>
    <message>
      <source>about {:.0f} min</source>
      <translation>environ {:.0f} min</translation>
    </message>
    <message>
      <source>Implicit</source>
      <translation>Implicite</translation>
    </message>
    <message>
      <source>Fillets, rounds, offsets, shells and infill that never fail, with a known error</source>
      <translation>Congés, arrondis, décalages, coques et remplissages qui n’échouent jamais, avec une erreur connue</translation>
    </message>
    <message>
      <source>The workbench Implicit needs Python packages that this FreeCAD does not have:</source>
      <translation>L’atelier Implicit a besoin de paquets Python que ce FreeCAD n’a pas :</translation>
    </message>
    <message>
      <source>Paste this into a terminal, then start FreeCAD again:</source>
      <translation>Collez ceci dans un terminal, puis redémarrez FreeCAD :</translation>
    </message>
    <message>
      <source>Packages are missing</source>
      <translation>Des paquets manquent</translation>
    </message>
    <message>
      <source>Copy the command</source>
      <translation>Copier la commande</translation>
    </message>
    <message>
      <source>Fillet</source>
      <translation>Congé</translation>
    </message>
    <message>
      <source>Fill concave edges, or those that you choose, with a rolling ball's surface</source>
      <translation>Remplir les arêtes concaves, ou celles choisies, par la surface d’une bille qui roule</translation>
    </message>
    <message>
      <source>Round</source>
      <translation>Arrondi</translation>
    </message>
    <message>
      <source>Round convex edges, or those that you choose</source>
      <translation>Arrondir les arêtes convexes, ou celles choisies</translation>
    </message>
    <message>
      <source>Smooth</source>
      <translation>Lisser</translation>
    </message>
    <message>
      <source>Fillet and round: concave and convex edges</source>
      <translation>Congés et arrondis : arêtes concaves et convexes</translation>
    </message>
    <message>
      <source>Chamfer</source>
      <translation>Chanfrein</translation>
    </message>
    <message>
      <source>Cut chosen edges off by a plane, or fill them</source>
      <translation>Couper les arêtes choisies par un plan, ou les remplir</translation>
    </message>
    <message>
      <source>Offset</source>
      <translation>Décalage</translation>
    </message>
    <message>
      <source>Grow or shrink a part by a distance</source>
      <translation>Agrandir ou rétrécir une pièce d’une distance</translation>
    </message>
    <message>
      <source>Shell</source>
      <translation>Coque</translation>
    </message>
    <message>
      <source>Hollow a part out, with faces left open</source>
      <translation>Évider une pièce, avec des faces laissées ouvertes</translation>
    </message>
    <message>
      <source>Infill</source>
      <translation>Remplissage</translation>
    </message>
    <message>
      <source>Fill a part with a lattice behind a skin</source>
      <translation>Remplir une pièce d’un treillis derrière une peau</translation>
    </message>
    <message>
      <source>Boolean</source>
      <translation>Booléen</translation>
    </message>
    <message>
      <source>Unite, cut or intersect two parts or meshes, with a fillet between them</source>
      <translation>Unir, couper ou intersecter deux pièces ou maillages, avec un congé entre eux</translation>
    </message>
    <message>
      <source>reports compare with the exact kernel, which does not take meshes</source>
      <translation>les rapports comparent avec le noyau exact, qui n’accepte pas les maillages</translation>
    </message>
    <message>
      <source>reports are for one radius; this feature has edges with their own</source>
      <translation>les rapports valent pour un seul rayon ; ici des arêtes ont le leur</translation>
    </message>
    <message>
      <source>Cancel</source>
      <translation>Annuler</translation>
    </message>
    <message>
      <source>There is no report</source>
      <translation>Il n’y a pas de rapport</translation>
    </message>
    <message>
      <source>Measuring the error of {} …</source>
      <translation>Mesure de l’erreur de {} …</translation>
    </message>
    <message>
      <source>the process ended without a word</source>
      <translation>le processus s’est terminé sans un mot</translation>
    </message>
    <message>
      <source>Report: {}</source>
      <translation>Rapport : {}</translation>
    </message>
    <message>
      <source>Error in colours</source>
      <translation>Erreur en couleurs</translation>
    </message>
    <message>
      <source>Result as a solid</source>
      <translation>Résultat en solide</translation>
    </message>
    <message>
      <source>Result as a mesh</source>
      <translation>Résultat en maillage</translation>
    </message>
    <message>
      <source>Result of {}</source>
      <translation>Résultat de {}</translation>
    </message>
    <message>
      <source>Edit {}</source>
      <translation>Modifier {}</translation>
    </message>
    <message>
      <source>Computing …</source>
      <translation>Calcul …</translation>
    </message>
    <message>
      <source>Radius</source>
      <translation>Rayon</translation>
    </message>
    <message>
      <source>Length</source>
      <translation>Longueur</translation>
    </message>
    <message>
      <source>Second length</source>
      <translation>Deuxième longueur</translation>
    </message>
    <message>
      <source>Distance</source>
      <translation>Distance</translation>
    </message>
    <message>
      <source>Thickness</source>
      <translation>Épaisseur</translation>
    </message>
    <message>
      <source>Wall lies</source>
      <translation>Paroi</translation>
    </message>
    <message>
      <source>Walls of the lattice</source>
      <translation>Parois du treillis</translation>
    </message>
    <message>
      <source>Cell size</source>
      <translation>Taille de cellule</translation>
    </message>
    <message>
      <source>Skin</source>
      <translation>Peau</translation>
    </message>
    <message>
      <source>Kind</source>
      <translation>Type</translation>
    </message>
    <message>
      <source>Follow smooth edges</source>
      <translation>Suivre les arêtes tangentes</translation>
    </message>
    <message>
      <source>FreeCAD's kernel first</source>
      <translation>Noyau de FreeCAD d’abord</translation>
    </message>
    <message>
      <source>Engine</source>
      <translation>Moteur</translation>
    </message>
    <message>
      <source>Tolerance</source>
      <translation>Tolérance</translation>
    </message>
    <message>
      <source>Grid spacing</source>
      <translation>Pas de la grille</translation>
    </message>
    <message>
      <source>Force</source>
      <translation>Forcer</translation>
    </message>
    <message>
      <source>exact distance</source>
      <translation>distance exacte</translation>
    </message>
    <message>
      <source>regular grid</source>
      <translation>grille régulière</translation>
    </message>
    <message>
      <source>inside</source>
      <translation>à l’intérieur</translation>
    </message>
    <message>
      <source>outside</source>
      <translation>à l’extérieur</translation>
    </message>
    <message>
      <source>on both sides</source>
      <translation>des deux côtés</translation>
    </message>
    <message>
      <source>union</source>
      <translation>union</translation>
    </message>
    <message>
      <source>difference</source>
      <translation>différence</translation>
    </message>
    <message>
      <source>intersection</source>
      <translation>intersection</translation>
    </message>
    <message>
      <source>Waiting for another computation …</source>
      <translation>Un autre calcul est en cours …</translation>
    </message>
    <message>
      <source>Starting the computing process …</source>
      <translation>Démarrage du processus de calcul …</translation>
    </message>
    <message>
      <source>First use: compiling for this computer (once) …</source>
      <translation>Première utilisation : compilation pour cet ordinateur (une fois) …</translation>
    </message>
    <message>
      <source>Reading the part …</source>
      <translation>Lecture de la pièce …</translation>
    </message>
    <message>
      <source>Meshing …</source>
      <translation>Maillage …</translation>
    </message>
    <message>
      <source>Building the surface …</source>
      <translation>Construction de la surface …</translation>
    </message>
    <message>
      <source>Checking …</source>
      <translation>Vérification …</translation>
    </message>
    <message>
      <source>Building the solid …</source>
      <translation>Construction du solide …</translation>
    </message>
    <message>
      <source>The source, and its edges or faces</source>
      <translation>La source, et ses arêtes ou faces</translation>
    </message>
    <message>
      <source>How distances are computed: exactly, or on a regular grid; chosen edges always exactly</source>
      <translation>Calcul des distances : exact, ou sur une grille régulière ; arêtes choisies toujours exactement</translation>
    </message>
    <message>
      <source>Ask FreeCAD's own kernel first, and take its result if it is sound</source>
      <translation>Demander d’abord au noyau de FreeCAD, et prendre son résultat s’il est sain</translation>
    </message>
    <message>
      <source>Go past refusals, as where most of the part would be lost</source>
      <translation>Passer outre les refus, par exemple si presque tout serait perdu</translation>
    </message>
    <message>
      <source>Go on along edges that continue the chosen ones smoothly</source>
      <translation>Continuer le long des arêtes tangentes à celles choisies</translation>
    </message>
    <message>
      <source>What it gives</source>
      <translation>Ce qui en sort</translation>
    </message>
    <message>
      <source>Largest accepted error; 0: automatic</source>
      <translation>Plus grande erreur admise ; 0 : automatique</translation>
    </message>
    <message>
      <source>Spacing of the grid; 0: automatic</source>
      <translation>Pas de la grille ; 0 : automatique</translation>
    </message>
    <message>
      <source>Largest expected error; -1: not known</source>
      <translation>Plus grande erreur attendue ; -1 : inconnue</translation>
    </message>
    <message>
      <source>Share of the area on exact surfaces, from 0 to 1</source>
      <translation>Part de l’aire sur des surfaces exactes, de 0 à 1</translation>
    </message>
    <message>
      <source>Who made it</source>
      <translation>Qui l’a fait</translation>
    </message>
    <message>
      <source>What it took</source>
      <translation>Ce que cela a pris</translation>
    </message>
    <message>
      <source>What may differ from what you expect</source>
      <translation>Ce qui peut différer de ce que vous attendez</translation>
    </message>
    <message>
      <source>Whether something changed since it was computed</source>
      <translation>Si quelque chose a changé depuis le calcul</translation>
    </message>
    <message>
      <source>Version of these properties</source>
      <translation>Version de ces propriétés</translation>
    </message>
    <message>
      <source>Of what the result was computed from</source>
      <translation>De quoi le résultat a été calculé</translation>
    </message>
    <message>
      <source>Radius of each chosen edge; 0: Radius</source>
      <translation>Rayon de chaque arête choisie ; 0 : Rayon</translation>
    </message>
    <message>
      <source>Where chosen edges and faces are</source>
      <translation>Où sont les arêtes et faces choisies</translation>
    </message>
    <message>
      <source>Length on the face on the left of an edge, seen from outside</source>
      <translation>Longueur sur la face à gauche de l’arête, vue de l’extérieur</translation>
    </message>
    <message>
      <source>Length on the face on its right; 0: the same</source>
      <translation>Longueur sur la face à droite ; 0 : la même</translation>
    </message>
    <message>
      <source>Positive grows, negative shrinks</source>
      <translation>Positif agrandit, négatif rétrécit</translation>
    </message>
    <message>
      <source>Thickness of the wall</source>
      <translation>Épaisseur de la paroi</translation>
    </message>
    <message>
      <source>Where the wall is</source>
      <translation>Où est la paroi</translation>
    </message>
    <message>
      <source>Thickness of the lattice's walls or struts</source>
      <translation>Épaisseur des parois ou barres du treillis</translation>
    </message>
    <message>
      <source>Period of the lattice</source>
      <translation>Période du treillis</translation>
    </message>
    <message>
      <source>The lattice</source>
      <translation>Le treillis</translation>
    </message>
    <message>
      <source>Thickness of the skin; 0: none</source>
      <translation>Épaisseur de la peau ; 0 : aucune</translation>
    </message>
    <message>
      <source>Radius of fillets along the joint; 0: sharp</source>
      <translation>Rayon des congés le long du joint ; 0 : vif</translation>
    </message>
    <message>
      <source>What is done</source>
      <translation>Ce qui est fait</translation>
    </message>
    <message>
      <source>The second object</source>
      <translation>Le deuxième objet</translation>
    </message>
    <message>
      <source>New features</source>
      <translation>Nouvelles fonctions</translation>
    </message>
    <message>
      <source>Tolerance (0: automatic)</source>
      <translation>Tolérance (0 : automatique)</translation>
    </message>
    <message>
      <source>Largest distance between a result and the true surface. 0 lets the grid follow from the radius.</source>
      <translation>Plus grande distance entre un résultat et la vraie surface. 0 : la grille découle du rayon.</translation>
    </message>
    <message>
      <source> mm</source>
      <translation> mm</translation>
    </message>
    <message>
      <source>Exact: distances to the part itself. Re-initialization: the scheme of the paper on a regular grid.</source>
      <translation>Exact : distances à la pièce même. Réinitialisation : le schéma de l’article sur une grille régulière.</translation>
    </message>
    <message>
      <source>Exact</source>
      <translation>Exact</translation>
    </message>
    <message>
      <source>Re-initialization</source>
      <translation>Réinitialisation</translation>
    </message>
    <message>
      <source>Preview while values are changed</source>
      <translation>Aperçu pendant les changements</translation>
    </message>
    <message>
      <source>This computer</source>
      <translation>Cet ordinateur</translation>
    </message>
    <message>
      <source>Threads (0: all cores)</source>
      <translation>Threads (0 : tous les cœurs)</translation>
    </message>
    <message>
      <source>Memory (0: most of what is free)</source>
      <translation>Mémoire (0 : presque tout ce qui est libre)</translation>
    </message>
    <message>
      <source>What one operation may take. Finer grids than fit are refused before anything is computed.</source>
      <translation>Ce qu’une opération peut prendre. Les grilles plus fines sont refusées avant tout calcul.</translation>
    </message>
    <message>
      <source> GiB</source>
      <translation> Gio</translation>
    </message>
  </context>
</TS>
